// Round trips of samples through a recording.
#include "waymark/recording/ros2/sample_decoder.hpp"

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

SensorTime at_ms(std::int64_t ms) { return SensorTime(Duration(ms * 1'000'000 + 123)); }

TagFrame some_frame(Random& random, SensorTime stamp, bool with_covariance) {
  TagFrame frame{.stamp = stamp};
  for (int i = 0; i < 3; ++i) {
    TagDetection tag{.tag = {FamilyId::TagStandard41h12, 5 * i}, .hamming = i, .decision_margin = 42};
    for (auto& corner : tag.corners_px) corner = {random.uniform(0, 640), random.uniform(0, 480)};
    if (with_covariance && i != 1) tag.corner_covariance_px2 = CornerCovariance::Identity() * (0.01 + i);
    frame.detections.push_back(tag);
  }
  return frame;
}

CameraModel some_camera() {
  return CameraModel::make(
             PinholeRadtan{
                 .fx = 442.17, .fy = 443.88, .cx = 323.5, .cy = 247, .k = {0.045, -0.077}, .coefficients = 4},
             640, 480)
      .value();
}

TEST(SampleRecorder, SamplesRoundTrip) {
  Random random(1);
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  ASSERT_TRUE(recorder);
  const SE3 base_T_cam(SO3::exp({0.1, -0.2, 0.3}), {0.08, 0, 0.18});
  ASSERT_TRUE(recorder->add_camera(at_ms(0), some_camera(), base_T_cam));
  ASSERT_TRUE(recorder->add_metadata("waymark", {{"anchor", "tag36h11:0"}}));
  std::vector<Sample> samples = {
      TagFrame{.stamp = at_ms(1)},
      some_frame(random, at_ms(2), true),
      some_frame(random, at_ms(3), false),
      Odometry{at_ms(4), SE2(1, -2, 0.5), 0.3, -0.1},
      WheelTicks{at_ms(5), 1.5, 2.5},
      ImuSample{at_ms(6), {0.1, 0.2, 0.3}, {0, 0, 9.8}},
      StampedCommand{at_ms(7), {0.25, -0.5}},
      TruthPose{at_ms(8), SE3(SO3::exp({0, 0, 1}), {1, 2, 0})},
  };
  for (const Sample& sample : samples) ASSERT_TRUE(recorder->add(sample));
  ASSERT_TRUE(recorder->close());

  const auto source = memory_source(file);
  const auto setup = read_setup(*source);
  ASSERT_TRUE(setup) << to_string(setup.error());
  EXPECT_TRUE(
      setup->camera->project({0.3, -0.2, 1.0})->isApprox(*some_camera().project({0.3, -0.2, 1.0}), 1e-12));
  EXPECT_TRUE((setup->base_T_cam->inverse() * base_T_cam).log().isZero(1e-12));
  EXPECT_EQ(setup->metadata.at("waymark").at("anchor"), "tag36h11:0");

  std::vector<Sample> back;
  const Status status = visit_samples(*source, [&](const Sample& sample) {
    back.push_back(sample);
    return Status{};
  });
  ASSERT_TRUE(status) << to_string(status.error());
  ASSERT_EQ(back.size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(back[i].index(), samples[i].index());
    EXPECT_EQ(stamp_of(back[i]), stamp_of(samples[i]));
  }
  const auto& frame = std::get<TagFrame>(back[1]);
  const auto& sent = std::get<TagFrame>(samples[1]);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(frame.detections[i].tag, sent.detections[i].tag);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_TRUE(frame.detections[i].corners_px[k].isApprox(sent.detections[i].corners_px[k], 1e-12));
    }
    EXPECT_EQ(frame.detections[i].corner_covariance_px2, sent.detections[i].corner_covariance_px2);
  }
  EXPECT_TRUE((std::get<Odometry>(back[3]).odom_T_base.inverse() * SE2(1, -2, 0.5)).log().isZero(1e-12));
  EXPECT_EQ(std::get<StampedCommand>(back[6]).command, (VelocityCommand{0.25, -0.5}));
}

Image some_image(int width, int height) {
  Random random(7);
  Image image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<std::uint8_t>(random.index(256));
  return image;
}

std::vector<Sample> through_a_file(const std::vector<Sample>& samples) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  for (const Sample& sample : samples) EXPECT_TRUE(recorder->add(sample));
  EXPECT_TRUE(recorder->close());
  std::vector<Sample> back;
  const Status status = visit_samples(*memory_source(file), [&](const Sample& sample) {
    back.push_back(sample);
    return Status{};
  });
  EXPECT_TRUE(status) << to_string(status.error());
  return back;
}

TEST(SampleRecorder, EveryKindOfSampleRoundTrips) {
  const SE3 cam_T_tag(SO3::exp({3, 0.1, 0.2}), {0.1, -0.2, 1.5});
  const std::vector<Sample> samples = {
      CameraFrame{at_ms(1), "cam", some_image(33, 17)},
      CameraFrame{at_ms(2), "left", some_image(8, 8)},
      TagPoseFrame{at_ms(3), "cam", {{{FamilyId::Tag36h11, 11}, cam_T_tag}}},
      RangeBearing{at_ms(4), 17, 3.25, -0.5},
      LaserScan{
          at_ms(5), -3.125, 0.0625, 0.001, 0.1, 12, {1.0F, 2.5F, std::numeric_limits<float>::infinity()}},
      GamepadState{at_ms(6), {-1.0F, 0.25F}, {0, 1, 1}},
      TagFrame{at_ms(7), "left", {}},
  };
  const auto back = through_a_file(samples);
  ASSERT_EQ(back.size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_EQ(back[i].index(), samples[i].index()) << i;
    EXPECT_EQ(stamp_of(back[i]), stamp_of(samples[i]));
  }
  EXPECT_EQ(std::get<CameraFrame>(back[0]).image, some_image(33, 17));
  EXPECT_EQ(std::get<CameraFrame>(back[0]).camera, "cam");
  EXPECT_EQ(std::get<CameraFrame>(back[1]).camera, "left");
  const auto& seen = std::get<TagPoseFrame>(back[2]).tags.at(0);
  EXPECT_EQ(seen.tag, (TagId{FamilyId::Tag36h11, 11}));
  EXPECT_TRUE((seen.cam_T_tag.inverse() * cam_T_tag).log().isZero(1e-12));
  const auto& bearing = std::get<RangeBearing>(back[3]);
  EXPECT_EQ(bearing.landmark, 17);
  EXPECT_EQ(bearing.range_m, 3.25);
  EXPECT_EQ(bearing.bearing_rad, -0.5);
  const auto& scan = std::get<LaserScan>(back[4]);
  EXPECT_EQ(scan.angle_min_rad, -3.125);
  EXPECT_EQ(scan.angle_increment_rad, 0.0625);
  EXPECT_NEAR(scan.time_increment_s, 0.001, 1e-9);
  EXPECT_NEAR(scan.range_min_m, 0.1, 1e-7);
  EXPECT_EQ(scan.ranges_m, std::get<LaserScan>(samples[4]).ranges_m);
  EXPECT_EQ(std::get<GamepadState>(back[5]).axes, (std::vector<float>{-1.0F, 0.25F}));
  EXPECT_EQ(std::get<GamepadState>(back[5]).buttons, (std::vector<std::int32_t>{0, 1, 1}));
  EXPECT_EQ(std::get<TagFrame>(back[6]).camera, "left");
}

/// Frames with unreliable tags at each subset of the positions, with and without covariances.
std::vector<TagFrame> frames_with_unreliable_tags() {
  Random random(3);
  std::vector<TagFrame> frames;
  for (int which = 0; which < 16; ++which) {
    TagFrame frame = some_frame(random, at_ms(10 + which), which >= 8);
    for (std::size_t i = 0; i < 3; ++i)
      if ((which >> i) % 2 != 0) frame.detections[i].corner_state = CornerState::Unreliable;
    frames.push_back(frame);
  }
  return frames;
}

TEST(SampleRecorder, KeepsUnreliableTagsInTheirOrder) {
  const std::vector<TagFrame> frames = frames_with_unreliable_tags();
  const std::vector<Sample> back = through_a_file({frames.begin(), frames.end()});
  ASSERT_EQ(back.size(), frames.size());
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const auto& tags = std::get<TagFrame>(back[f]).detections;
    ASSERT_EQ(tags.size(), 3U) << f;
    for (std::size_t i = 0; i < 3; ++i) {
      const TagDetection& sent = frames[f].detections[i];
      EXPECT_EQ(tags[i].tag, sent.tag) << f;
      EXPECT_EQ(tags[i].corner_state, sent.corner_state) << f;
      EXPECT_EQ(tags[i].corner_covariance_px2, sent.corner_covariance_px2) << f;
      EXPECT_TRUE(tags[i].corners_px[2].isApprox(sent.corners_px[2], 1e-12)) << f;
    }
  }
}

// Like a program that does not support the type of unreliable tags.
TEST(SampleRecorder, UnreliableTagsAreNotInTheDetections) {
  for (const TagFrame& frame : frames_with_unreliable_tags()) {
    std::vector<Sample> seen;
    SampleDecoder decoder([&](const Sample& sample) {
      seen.push_back(sample);
      return Status{};
    });
    const auto add = [&](const auto& message) {
      return decoder.add("/x", std::remove_cvref_t<decltype(message)>::kType, 0, cdr::encode(message));
    };
    ASSERT_TRUE(add(ros2::to_ros(frame)));
    ASSERT_TRUE(add(ros2::covariances_to_ros(frame)));
    ASSERT_TRUE(decoder.finish());
    std::vector<TagDetection> usable = frame.detections;
    std::erase_if(usable, [](const TagDetection& tag) { return !usable_corners(tag); });
    const auto& tags = std::get<TagFrame>(seen.at(0)).detections;
    ASSERT_EQ(tags.size(), usable.size());
    for (std::size_t i = 0; i < tags.size(); ++i) {
      EXPECT_EQ(tags[i].tag, usable[i].tag);
      EXPECT_EQ(tags[i].corner_covariance_px2, usable[i].corner_covariance_px2);
    }
  }
}

TEST(SampleDecoder, RejectsUnreliableTagsThatDoNotMatchTheirFrame) {
  TagFrame frame = frames_with_unreliable_tags().at(2);
  const ros2::UnreliableTags good = ros2::unreliable_to_ros(frame);
  std::erase_if(frame.detections, [](const TagDetection& tag) { return !usable_corners(tag); });
  std::vector<ros2::UnreliableTags> bad(4, good);
  bad[0].index = {3};
  bad[1].index = {-1};
  bad[2].index.clear();
  bad[3].covariance_px2.pop_back();
  for (const ros2::UnreliableTags& message : bad) {
    TagFrame changed = frame;
    EXPECT_EQ(ros2::add_unreliable(changed, message).error().code, ErrorCode::Unreadable);
    EXPECT_EQ(changed.detections.size(), 2U);
  }
  EXPECT_TRUE(ros2::add_unreliable(frame, good));
}

TEST(SampleDecoder, RejectsNonFiniteNumbers) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  SampleDecoder decoder([](const Sample&) { return Status{}; });
  const auto add = [&](const std::string& topic, const auto& message) {
    return decoder.add(topic, std::remove_cvref_t<decltype(message)>::kType, 0, cdr::encode(message));
  };
  ros2::PoseStamped truth;
  EXPECT_TRUE(add("/truth/pose", truth));
  truth.pose.orientation.x = nan;
  EXPECT_EQ(add("/truth/pose", truth).error().code, ErrorCode::Unreadable);
  ros2::Odometry odometry;
  EXPECT_TRUE(add("/odom", odometry));
  odometry.pose.pose.orientation = {0, 0, 0, 0};
  EXPECT_FALSE(add("/odom", odometry));
  ros2::Imu imu;
  imu.angular_velocity.y = nan;
  EXPECT_FALSE(add("/imu", imu));
  EXPECT_FALSE(add("/range_bearing", ros2::RangeBearing{.range_m = nan}));
}

}  // namespace
}  // namespace waymark

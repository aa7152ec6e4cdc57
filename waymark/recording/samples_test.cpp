// Samples go into a recording and come back as they were.
#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/recording/sample_reader.hpp"
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

TEST(SampleRecorder, WhatIsRecordedComesBack) {
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

// The corners on the wire are those of apriltag_ros: bottom left first, pixel centres at integers.
TEST(Ros2Convert, CornersOnTheWireAreThoseOfAprilTagRos) {
  TagFrame frame;
  TagDetection tag{.tag = {FamilyId::Tag36h11, 7}};
  tag.corners_px = {Eigen::Vector2d(10.5, 20.5), Eigen::Vector2d(30.5, 20.5), Eigen::Vector2d(30.5, 40.5),
                    Eigen::Vector2d(10.5, 40.5)};
  frame.detections = {tag};
  const auto message = ros2::to_ros(frame);
  ASSERT_EQ(message.detections.size(), 1U);
  EXPECT_EQ(message.detections[0].family, "tag36h11");
  EXPECT_EQ(message.detections[0].corners[0].x, 10);  // bottom left
  EXPECT_EQ(message.detections[0].corners[0].y, 40);
  EXPECT_EQ(message.detections[0].corners[3].y, 20);  // top left
  EXPECT_EQ(message.detections[0].centre.x, 20);
}

// x of the tag to the right, y down, the border at 1: as libapriltag's H, row by row.
TEST(Ros2Convert, TheHomographyTakesTheSquareOfTheTagToItsCorners) {
  Eigen::Matrix3d px_H_tag;
  px_H_tag << 40, -7, 210, 5, 33, 120, 0.08, -0.05, 1;
  const auto project = [&](double x, double y) -> Eigen::Vector2d {
    return (px_H_tag * Eigen::Vector3d(x, y, 1)).hnormalized();
  };
  const Eigen::Vector2d half(0.5, 0.5);  // pixel centres are at integers there
  TagDetection tag;
  tag.corners_px = {project(-1, -1) + half, project(1, -1) + half, project(1, 1) + half,
                    project(-1, 1) + half};
  const auto message = ros2::to_ros(TagFrame{.detections = {tag}});
  for (int i = 0; i < 9; ++i)
    EXPECT_NEAR(message.detections[0].homography[static_cast<std::size_t>(i)], px_H_tag(i / 3, i % 3), 1e-9);
  EXPECT_NEAR(message.detections[0].centre.x, 210, 1e-9) << "where the diagonals meet, not the mean";
  EXPECT_NEAR(message.detections[0].centre.y, 120, 1e-9);
  tag.corners_px.fill({3, 4});
  const auto none = ros2::to_ros(TagFrame{.detections = {tag}});
  EXPECT_EQ(none.detections[0].homography, (std::array<double, 9>{}));
  EXPECT_EQ(none.detections[0].centre.x, 2.5);
}

TEST(Ros2Convert, CameraInfoHasCentresAtIntegers) {
  const auto info = ros2::to_ros(some_camera(), SensorTime{});
  EXPECT_DOUBLE_EQ(info.k[2], 323.0);
  EXPECT_DOUBLE_EQ(info.k[5], 246.5);
  EXPECT_EQ(info.distortion_model, "plumb_bob");
  EXPECT_EQ(info.d.size(), 5U);
}

TEST(Ros2Convert, StampsBeforeTheEpochAndAfterComeBack) {
  for (const std::int64_t ns :
       {0LL, 1LL, 999'999'999LL, 1'700'000'000'123'456'789LL, -1LL, -1'000'000'001LL}) {
    EXPECT_EQ(ros2::from_ros(ros2::to_ros(SensorTime(Duration(ns)))).time_since_epoch().count(), ns);
  }
}

}  // namespace
}  // namespace waymark

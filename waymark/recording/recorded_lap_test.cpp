#include "waymark/recording/recorded_lap.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/mcap/writer.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

SensorTime ms(int value) { return SensorTime(std::chrono::milliseconds(value)); }

CameraModel lap_camera() {
  return CameraModel::make(PinholeRadtan{.fx = 40, .fy = 40, .cx = 16, .cy = 12}, 32, 24).value();
}

struct Lap {
  bool tags = true;
  bool images = false;
  bool cut = false;
  bool damaged = false;
};

Bytes record(const Lap& lap) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file), {.chunk_size_bytes = 2000});
  EXPECT_TRUE(recorder);
  EXPECT_TRUE(recorder->add_camera(ms(0), lap_camera(), SE3(SO3(), {0.1, 0, 0.2})));
  EXPECT_TRUE(recorder->add_attachment("robot.yaml", "application/yaml", ms(0), "name: limo\n"));
  for (int i = 1; i <= 100; ++i) {
    EXPECT_TRUE(recorder->add(Odometry{ms(10 * i), SE2(0.01 * i, 0, 0), 1, 0}));
    EXPECT_TRUE(recorder->add(ImuSample{ms(10 * i), {0, 0, 0.1}, {0, 0, 9.8}}));
    EXPECT_TRUE(recorder->add(TruthPose{ms(10 * i), lift(SE2(0.01 * i, 0, 0))}));
    if (lap.tags) {
      TagFrame frame{.stamp = ms(10 * i), .detections = std::vector<TagDetection>(1)};
      frame.detections[0].tag.number = 7;
      EXPECT_TRUE(recorder->add(frame));
    }
    if (lap.images && i % 10 == 0)
      EXPECT_TRUE(recorder->add(CameraFrame{.stamp = ms(10 * i), .image = Image(32, 24)}));
  }
  EXPECT_TRUE(recorder->close());
  if (lap.cut) file.resize(file.size() * 2 / 3);
  if (lap.damaged)
    for (std::size_t i = 0; i < 40; ++i) file[file.size() / 2 + i] ^= 0x5AU;
  return file;
}

Result<RecordedLap> lap_of(const Bytes& file, const FrameFinder& find = {},
                           TagSource source = TagSource::AsRecorded) {
  auto log = open_log(memory_source(file, "lap.mcap"));
  if (!log) return tl::unexpected(log.error());
  return read_lap(**log, find, source);
}

/// Reports tag 3 in every image.
struct Finder {
  int asked = 0;
  bool had_camera = false;
  FrameFinder function() {
    return [this](const CameraFrame& image, ImageLens lens) -> Result<TagFrame> {
      ++asked;
      had_camera = lens.known();
      TagFrame frame{.stamp = image.stamp, .detections = std::vector<TagDetection>(1)};
      frame.detections[0].tag.number = 3;
      return frame;
    };
  }
};

TEST(ReadLap, ReadsEverythingThatMappingNeeds) {
  const Bytes file = record({});
  const auto lap = lap_of(file);
  ASSERT_TRUE(lap) << to_string(lap.error());
  EXPECT_EQ(lap->frames.size(), 100U);
  EXPECT_EQ(lap->odometry.size(), 100U);
  EXPECT_EQ(lap->imu.size(), 100U);
  EXPECT_EQ(lap->truth.size(), 100U);
  EXPECT_THAT(lap->tag_poses, IsEmpty());
  EXPECT_EQ(lap->attachments.at("robot.yaml"), "name: limo\n");
  EXPECT_TRUE(lap->setup.camera);
  EXPECT_NEAR(lap->setup.base_T_cam->translation().z(), 0.2, 1e-12);
  EXPECT_THAT(lap->setup.problems, IsEmpty());
  EXPECT_EQ(lap->odometry.back().stamp, ms(1000));
}

std::vector<int> stamps_ms(const RecordedLap& lap) {
  std::vector<int> all;
  for (const TagFrame& frame : lap.frames)
    all.push_back(static_cast<int>(frame.stamp.time_since_epoch() / std::chrono::milliseconds(1)));
  return all;
}

TEST(ReadLap, SortsLateImagesAndSkipsRepeatedOnes) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file), {});
  ASSERT_TRUE(recorder);
  int now = 0;
  for (const int stamp : {10, 30, 20, 40, 40, 50}) {
    now += 10;
    ASSERT_TRUE(recorder->add(Odometry{ms(now), SE2(0.001 * now, 0, 0), 1, 0}));
    ASSERT_TRUE(recorder->add(TagFrame{.stamp = ms(stamp)}));
  }
  ASSERT_TRUE(recorder->close());
  const auto lap = lap_of(file);
  ASSERT_TRUE(lap) << to_string(lap.error());
  EXPECT_THAT(stamps_ms(*lap), ElementsAre(10, 20, 30, 40, 50));
  ASSERT_EQ(lap->notes.size(), 2U);
  EXPECT_THAT(lap->notes[0], HasSubstr("1 image"));
  EXPECT_THAT(lap->notes[1], HasSubstr("1 image"));
  for (const std::string& note : lap->notes) testing::expect_on_page("recording", note);
}

TEST(ReadLap, KeepsTheOrderOfImagesIfTheClockWentBack) {
  RecordedLap lap;
  for (const int stamp : {9000, 9010, 10, 20}) lap.frames.push_back({.stamp = ms(stamp)});
  order_frames(lap);
  EXPECT_THAT(stamps_ms(lap), ElementsAre(9000, 9010, 10, 20));
  EXPECT_THAT(lap.notes, IsEmpty());
  RecordedLap two;
  for (const char* camera : {"left", "right"}) two.frames.push_back({.stamp = ms(10), .camera = camera});
  order_frames(two);
  EXPECT_EQ(two.frames.size(), 2U) << "two cameras with the same stamp";
}

/// A lap whose odometry, IMU data and ground truth begin these many milliseconds after the images.
RecordedLap lap_of_clocks(int odometry_ms, int imu_ms, int truth_ms) {
  RecordedLap lap;
  for (int i = 1; i <= 100; ++i) {
    lap.frames.push_back({.stamp = ms(100 * i)});
    lap.odometry.push_back({ms(100 * i + odometry_ms), SE2(0.01 * i, 0, 0), 1, 0});
    lap.imu.push_back({.stamp = ms(100 * i + imu_ms)});
    lap.truth.push_back({ms(100 * i + truth_ms), SE3()});
  }
  return lap;
}

TEST(ReadLap, SamplesOfAnotherClockAreNotUsed) {
  constexpr int kHour_ms = 3'600'000;
  RecordedLap one = lap_of_clocks(5, -5, 0);
  remove_other_clocks(one);
  EXPECT_FALSE(one.other_clock);
  EXPECT_EQ(one.odometry.size() + one.imu.size() + one.truth.size(), 300U);
  RecordedLap lap = lap_of_clocks(kHour_ms, kHour_ms, 0);
  remove_other_clocks(lap);
  EXPECT_THAT(lap.odometry, IsEmpty());
  EXPECT_THAT(lap.imu, IsEmpty());
  EXPECT_EQ(lap.truth.size(), 100U);
  EXPECT_EQ(lap.frames.size(), 100U);
  ASSERT_TRUE(lap.other_clock);
  EXPECT_EQ(lap.other_clock->error.code, ErrorCode::InvalidArgument);
  EXPECT_THAT(lap.other_clock->error.message, HasSubstr("3600 s"));
  testing::expect_on_page("recording", lap.other_clock->error);
  RecordedLap truth = lap_of_clocks(0, 0, kHour_ms);
  remove_other_clocks(truth);
  EXPECT_THAT(truth.truth, IsEmpty());
  EXPECT_TRUE(affects(truth.other_clock, StampedKind::Truth));
  EXPECT_FALSE(affects(truth.other_clock, StampedKind::Odometry));
  EXPECT_EQ(truth.odometry.size(), 100U);
  RecordedLap poses = lap_of_clocks(kHour_ms, 0, 0);
  for (const TagFrame& frame : poses.frames) poses.tag_poses.push_back({.stamp = frame.stamp});
  poses.frames.clear();
  remove_other_clocks(poses);
  EXPECT_THAT(poses.odometry, IsEmpty());
}

/// A recording with these odometry messages and transforms from odom to base_link.
Bytes record_motion(bool on_topic, bool in_transforms) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  EXPECT_TRUE(recorder);
  EXPECT_TRUE(recorder->add_camera(ms(0), lap_camera(), SE3(SO3(), {0.1, 0, 0.2})));
  for (int i = 1; i <= 50; ++i) {
    EXPECT_TRUE(recorder->add(TagFrame{.stamp = ms(20 * i)}));
    if (on_topic) EXPECT_TRUE(recorder->add(Odometry{ms(20 * i), SE2(0.02 * i, 0, 0), 1, 0}));
    const SE3 odom_T_base = lift(SE2(0.01 * i, 0.002 * i, 0.01 * i));
    const ros2::TFMessage transforms{{ros2::to_ros_transform(ms(20 * i), "map", "odom", SE3()),
                                      ros2::to_ros_transform(ms(20 * i), "odom", "base_link", odom_T_base)}};
    if (in_transforms) EXPECT_TRUE(recorder->add_message(topics::kTf, ms(20 * i), transforms));
    if (in_transforms) EXPECT_TRUE(recorder->add_message(topics::kTf, ms(20 * i), transforms));
  }
  EXPECT_TRUE(recorder->close());
  return file;
}

TEST(ReadLap, OdometryIsReadFromTransformsIfThereIsNoTopic) {
  const auto lap = lap_of(record_motion(false, true));
  ASSERT_TRUE(lap) << to_string(lap.error());
  ASSERT_EQ(lap->odometry.size(), 50U) << "repeated transforms count once";
  EXPECT_NEAR(lap->odometry.back().odom_T_base.x(), 0.5, 1e-9);
  EXPECT_NEAR(lap->odometry.back().odom_T_base.yaw(), 0.5, 1e-9);
  EXPECT_EQ(lap->odometry.back().stamp, ms(1000));
  EXPECT_EQ(lap->setup.chosen.odometry, "/tf (odom to base_link)");
  EXPECT_FALSE(lap->other_clock);
}

TEST(ReadLap, AnOdometryTopicTakesPrecedenceOverTransforms) {
  const auto lap = lap_of(record_motion(true, true));
  ASSERT_TRUE(lap) << to_string(lap.error());
  ASSERT_EQ(lap->odometry.size(), 50U);
  EXPECT_NEAR(lap->odometry.back().odom_T_base.x(), 1.0, 1e-9);
  EXPECT_EQ(lap->setup.chosen.odometry, "/odom");
  const auto none = lap_of(record_motion(false, false));
  ASSERT_TRUE(none);
  EXPECT_THAT(none->odometry, IsEmpty());
  EXPECT_EQ(none->setup.chosen.odometry, "");
}

/// A recording of transforms in one message per second; the first are not moving, and one is damaged.
struct Transforms {
  int seconds = 30;
  int still = 0;     ///< number of messages before the robot moves
  int damaged = -1;  ///< a message that cannot be decoded
};

Bytes record_transforms(const Transforms& wanted) {
  Bytes file;
  auto writer = mcap::Writer::open(memory_sink(file), {.chunk_size_bytes = 200});
  EXPECT_TRUE(writer);
  const std::string text = ros2::schema_text(ros2::TFMessage::kType);
  const auto schema = writer->add_schema(std::string(ros2::TFMessage::kType), "ros2msg", as_bytes(text));
  const auto channel = writer->add_channel(topics::kTf, *schema, "cdr");
  for (int i = 1; i <= wanted.seconds; ++i) {
    const SE3 odom_T_base = lift(SE2(0.1 * std::max(0, i - wanted.still), 0, 0));
    Bytes message = cdr::encode(
        ros2::TFMessage{{ros2::to_ros_transform(ms(1000 * i), "odom", "base_link", odom_T_base)}});
    if (i == wanted.damaged) message.resize(message.size() / 2);
    const auto time = static_cast<std::uint64_t>(i) * 1'000'000'000;
    EXPECT_TRUE(writer->write(*channel, time, time, message));
  }
  EXPECT_TRUE(writer->close());
  return file;
}

Result<RecordingSetup> setup_of(const Bytes& file, const CameraChoice& choice = {}) {
  auto log = open_log(memory_source(file, "lap.mcap"));
  if (!log) return tl::unexpected(log.error());
  return (*log)->setup(choice);
}

TEST(ReadLap, ATransformThatCannotBeDecodedIsNoted) {
  const auto lap = lap_of(record_transforms({.damaged = 4}));
  ASSERT_TRUE(lap) << to_string(lap.error());
  EXPECT_EQ(lap->odometry.size(), 29U);
  ASSERT_EQ(lap->setup.problems.size(), 1U);
  EXPECT_EQ(lap->setup.problems[0].place.key, "/tf");
}

TEST(ReadLap, TransformsThatNeverChangeAreNotOdometry) {
  const auto lap = lap_of(record_transforms({.still = 30}));
  ASSERT_TRUE(lap) << to_string(lap.error());
  EXPECT_THAT(lap->odometry, IsEmpty());
  EXPECT_FALSE(lap->setup.chosen.notes.empty());
  const auto late = lap_of(record_transforms({.still = 25}));
  ASSERT_TRUE(late);
  EXPECT_EQ(late->odometry.size(), 30U) << "the robot drives in the end";
}

TEST(RecordingSetup, OnlyTheBeginningOfTheTransformsIsRead) {
  const auto begins = setup_of(record_transforms({.damaged = 20}));
  ASSERT_TRUE(begins);
  EXPECT_TRUE(begins->chosen.odometry_frames);
  EXPECT_EQ(begins->problems.size(), 1U) << "the mounting is unknown, so all transforms are read for it";
  const auto quick = setup_of(record_transforms({.still = 25}), {.quick = true});
  ASSERT_TRUE(quick);
  EXPECT_TRUE(quick->chosen.odometry_frames);
  const auto damaged_later = setup_of(record_transforms({.damaged = 20}), {.quick = true});
  ASSERT_TRUE(damaged_later);
  EXPECT_THAT(damaged_later->problems, IsEmpty());
}

TEST(ReadLap, SearchesImagesOnlyIfThereAreNoTags) {
  Finder finder;
  const Bytes with_tags = record({.images = true});
  const auto recorded = lap_of(with_tags, finder.function());
  ASSERT_TRUE(recorded);
  EXPECT_EQ(finder.asked, 0);
  EXPECT_EQ(recorded->frames[0].detections[0].tag.number, 7);
  const Bytes without = record({.tags = false, .images = true});
  const auto found = lap_of(without, finder.function());
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_EQ(finder.asked, 10);
  EXPECT_TRUE(finder.had_camera);
  ASSERT_EQ(found->frames.size(), 10U);
  EXPECT_EQ(found->frames[0].detections[0].tag.number, 3);
  const auto unasked = lap_of(without);
  ASSERT_TRUE(unasked);
  EXPECT_THAT(unasked->frames, IsEmpty()) << "no finder was given";
}

TEST(ReadLap, IgnoresRecordedTagsIfImagesAreRequested) {
  Finder finder;
  const Bytes file = record({.images = true});
  const auto lap = lap_of(file, finder.function(), TagSource::Images);
  ASSERT_TRUE(lap) << to_string(lap.error());
  ASSERT_EQ(lap->frames.size(), 10U);
  EXPECT_EQ(lap->frames[0].detections[0].tag.number, 3);
  const Bytes none = record({});
  const auto missing = lap_of(none, finder.function(), TagSource::Images);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
}

TEST(ReadLap, NamesDepthImagesIfThereAreNoOthers) {
  constexpr const char* kDepth = "/depth/image/compressedDepth";
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file), {});
  ASSERT_TRUE(recorder);
  ASSERT_TRUE(recorder->add(Odometry{.stamp = ms(1)}));
  ASSERT_TRUE(recorder->add_message(kDepth, ms(1), ros2::CompressedImage{.data = Bytes(40)}));
  ASSERT_TRUE(recorder->close());
  Finder finder;
  const auto lap = lap_of(file, finder.function());
  ASSERT_TRUE(lap) << to_string(lap.error());
  EXPECT_THAT(lap->notes, ::testing::Contains(HasSubstr(kDepth)));
  const auto images = lap_of(file, finder.function(), TagSource::Images);
  ASSERT_FALSE(images);
  EXPECT_EQ(images.error().place.key, kDepth);
  EXPECT_EQ(finder.asked, 0);
}

TEST(ReadLap, AFinderErrorEndsTheReading) {
  int asked = 0;
  const Bytes file = record({.tags = false, .images = true});
  const auto lap = lap_of(file, [&](const CameraFrame&, ImageLens) -> Result<TagFrame> {
    if (++asked == 3) return fail(ErrorCode::Unreadable, "stopped");
    return TagFrame{};
  });
  ASSERT_FALSE(lap);
  EXPECT_EQ(lap.error().message, "stopped");
  EXPECT_EQ(asked, 3);
}

TEST(ReadLap, ReadsATruncatedRecordingAndReportsTheTruncation) {
  const Bytes file = record({.cut = true});
  const auto lap = lap_of(file);
  ASSERT_TRUE(lap) << to_string(lap.error());
  EXPECT_GT(lap->frames.size(), 10U);
  EXPECT_LT(lap->frames.size(), 100U);
  EXPECT_TRUE(lap->setup.camera);
  ASSERT_FALSE(lap->setup.problems.empty());
  EXPECT_EQ(lap->setup.problems[0].place.source, "lap.mcap");
}

TEST(ReadLap, SkipsAndReportsADamagedChunk) {
  const Bytes file = record({.damaged = true});
  const auto lap = lap_of(file);
  ASSERT_TRUE(lap) << to_string(lap.error());
  EXPECT_LT(lap->odometry.size(), 100U);
  EXPECT_EQ(lap->odometry.back().stamp, ms(1000)) << "data after the damage are read";
  ASSERT_FALSE(lap->setup.problems.empty());
  EXPECT_TRUE(lap->setup.problems[0].place.byte) << to_string(lap->setup.problems[0]);
}

TEST(ReadLap, AnEmptyRecordingGivesAnEmptyLap) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  ASSERT_TRUE(recorder);
  ASSERT_TRUE(recorder->close());
  const auto lap = lap_of(file);
  ASSERT_TRUE(lap) << to_string(lap.error());
  EXPECT_THAT(lap->frames, IsEmpty());
  EXPECT_FALSE(lap->setup.camera);
}

TEST(RecordedLap, IdsBeyondTag36h11ChangeTheFamily) {
  RecordedLap lap;
  lap.frames.push_back({.detections = {{.tag = {FamilyId::Tag36h11, 5}}, {.tag = {FamilyId::Tag25h9, 5}}}});
  const RecordedLap before = lap;
  name_family(lap);
  EXPECT_EQ(lap.frames[0].detections[0].tag, before.frames[0].detections[0].tag);
  EXPECT_TRUE(lap.notes.empty());
  lap.frames.push_back({.detections = {{.tag = {FamilyId::Tag36h11, 587}}}});
  name_family(lap);
  EXPECT_EQ(lap.frames[0].detections[0].tag, (TagId{FamilyId::TagStandard41h12, 5}));
  EXPECT_EQ(lap.frames[0].detections[1].tag, (TagId{FamilyId::Tag25h9, 5}));
  EXPECT_EQ(lap.frames[1].detections[0].tag, (TagId{FamilyId::TagStandard41h12, 587}));
  ASSERT_EQ(lap.notes.size(), 1U);
  EXPECT_NE(lap.notes[0].find("587"), std::string::npos);
}

TEST(RecordedLap, RejoinsOdometryAfterAReset) {
  RecordedLap lap;
  const auto drive = [&lap](const SE2& begin, int from) {
    for (int i = from; i < from + 20; ++i)
      lap.odometry.push_back({.stamp = SensorTime(std::chrono::milliseconds(50 * i)),
                              .odom_T_base = begin * SE2::exp({0.02 * (i - from), 0, 0.05 * (i - from)}),
                              .speed_m_s = 0.4});
  };
  drive(SE2(1, 2, 0.5), 0);
  const SE2 end = lap.odometry.back().odom_T_base;
  const RecordedLap whole = lap;
  RecordedLap untouched = whole;
  rejoin_odometry(untouched);
  EXPECT_THAT(untouched.notes, ::testing::IsEmpty());
  EXPECT_EQ(untouched.odometry[7].odom_T_base.translation(), whole.odometry[7].odom_T_base.translation());
  drive(SE2(), 30);  // after half a second, as if the robot had been restarted
  rejoin_odometry(lap);
  ASSERT_EQ(lap.notes.size(), 1U);
  EXPECT_THAT(lap.notes[0], HasSubstr("1 time"));
  testing::expect_on_page("recording", lap.notes[0]);
  for (std::size_t i = 20; i < 40; ++i) {
    const double t = static_cast<double>(i) - 20;
    const SE2 expected = end * SE2::exp({0.02 * t, 0, 0.05 * t});
    EXPECT_LT((lap.odometry[i].odom_T_base.translation() - expected.translation()).norm(), 1e-9) << i;
    EXPECT_NEAR(lap.odometry[i].odom_T_base.yaw(), expected.yaw(), 1e-9) << i;
  }
}

}  // namespace
}  // namespace waymark

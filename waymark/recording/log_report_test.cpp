// Tests of timing reports.
#include "waymark/recording/log_report.hpp"

#include <gtest/gtest.h>

#include "waymark/recording/mcap/writer.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/samples/clock_check.hpp"

namespace waymark {
namespace {

constexpr std::uint64_t kMs = 1'000'000;

TEST(StampStatistics, ARegularStreamHasNoGaps) {
  StampStatistics stamps;
  for (std::uint64_t i = 1; i <= 200; ++i) stamps.add(i * 20 * kMs + i % 3 * kMs);
  EXPECT_TRUE(stamps.periodic());
  EXPECT_NEAR(*stamps.median_ns(), 20e6, 1.1e6);
  EXPECT_EQ(stamps.gaps(), 0U);
  EXPECT_EQ(stamps.dropped(), 0U);
  EXPECT_EQ(stamps.zero() + stamps.duplicate() + stamps.backward(), 0U);
}

TEST(StampStatistics, CountsMissingStamps) {
  StampStatistics stamps;
  for (std::uint64_t i = 1; i <= 300; ++i) {
    if (i % 50 == 0 || (i > 120 && i <= 130)) continue;  // 6 single stamps, none in the gap of ten
    stamps.add(i * 20 * kMs);
  }
  EXPECT_NEAR(*stamps.median_ns(), 20e6, 20e6 * 0.002);
  EXPECT_EQ(stamps.gaps(), 6U);  // a missing stamp at the end cannot be detected
  EXPECT_EQ(stamps.dropped(), 15U);
  EXPECT_EQ(stamps.longest_ns(), 220 * kMs);
}

TEST(StampStatistics, ClassifiesInvalidStamps) {
  StampStatistics stamps;
  for (const std::uint64_t ms : {100U, 110U, 110U, 120U, 0U, 130U, 125U}) stamps.add(ms * kMs);
  EXPECT_EQ(stamps.duplicate(), 1U);
  EXPECT_EQ(stamps.zero(), 1U);
  EXPECT_EQ(stamps.backward(), 2U);
  EXPECT_FALSE(stamps.periodic());  // too few stamps
}

TEST(StampStatistics, AnIrregularStreamHasNoDrops) {
  StampStatistics stamps;
  std::uint64_t t = 0;
  for (std::uint64_t i = 1; i <= 200; ++i) stamps.add(t += (i % 7) * (i % 11) * kMs + kMs);
  EXPECT_FALSE(stamps.periodic());
  EXPECT_EQ(stamps.dropped(), 0U);
}

/// Odometry at 50 Hz whose stamps jump by `jump_s` against the log time in the middle.
Bytes with_jump(double jump_s) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  for (int i = 0; i < 100; ++i) {
    const SensorTime log_time(std::chrono::milliseconds(10'000 + 20 * i));
    const SensorTime stamp = log_time + Duration(i < 50 ? 0 : static_cast<std::int64_t>(jump_s * 1e9));
    ros2::PoseStamped pose{.header = {ros2::to_ros(stamp), "map"}};
    EXPECT_TRUE(recorder->add_message("/pose", log_time, pose));
  }
  EXPECT_TRUE(recorder->add(CameraFrame{SensorTime(std::chrono::seconds(10)), "cam", Image(4, 4)}));
  EXPECT_TRUE(recorder->add(GamepadState{SensorTime(std::chrono::seconds(10)), {}, {}}));
  EXPECT_TRUE(recorder->close());
  return file;
}

TEST(LogReport, DetectsAClockJump) {
  for (const double jump_s : {0.0, 0.4, 3600.0, -7.0}) {
    const Bytes file = with_jump(jump_s);
    const auto log = open_log(memory_source(file));
    ASSERT_TRUE(log);
    const auto report = report_on(**log);
    ASSERT_TRUE(report);
    const TopicReport& pose = report->topics.at(2);
    EXPECT_EQ(pose.topic, "/pose");
    EXPECT_TRUE(pose.has_header);
    EXPECT_EQ(pose.messages, 100U);
    EXPECT_NEAR(pose.rate_hz, 50, 1e-6);
    const bool jumps = std::abs(jump_s) > 0.5;
    EXPECT_EQ(pose.clock_jumps, jumps ? 1U : 0U) << jump_s;
    EXPECT_NEAR(pose.largest_jump_s, jumps ? jump_s : 0, 1e-6);
    EXPECT_EQ(pose.stamps.backward(), jump_s < 0 ? 1U : 0U);
    EXPECT_NEAR(report->duration_s, 1.98, 1e-9);
    EXPECT_EQ(quick_report_on(**log).messages, report->messages);
    EXPECT_EQ(*contents_of(**log), (LogContents{"images", "gamepad"}));
  }
}

TEST(ContentsOf, OnlyTopicsThatAreUsedCountForTheClocks) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  ASSERT_TRUE(recorder);
  for (int i = 1; i <= 20; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(100 * i));
    const SensorTime other = stamp + std::chrono::hours(1);
    ASSERT_TRUE(recorder->add(TagFrame{.stamp = stamp}));
    ASSERT_TRUE(recorder->add(Odometry{.stamp = stamp}));
    ASSERT_TRUE(recorder->add_message("/other", stamp, ros2::to_ros(Odometry{.stamp = other})));
  }
  ASSERT_TRUE(recorder->close());
  const auto log = open_log(memory_source(file));
  ASSERT_TRUE(log);
  auto setup = (*log)->setup();
  ASSERT_TRUE(setup);
  EXPECT_TRUE(setup->chosen.unused.contains("/other"));
  ClockCheck clocks;
  EXPECT_EQ(*contents_of(**log, true, &clocks, &*setup), (LogContents{"tags", "odometry"}));
  EXPECT_FALSE(clocks.mismatch());
  setup->chosen.unused = {"/odom"};
  ClockCheck apart;
  EXPECT_EQ(*contents_of(**log, true, &apart, &*setup), (LogContents{"tags", "odometry"}));
  EXPECT_TRUE(apart.mismatch());
}

TEST(LogReport, ZeroStampedDescriptionsDoNotExtendTheDuration) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 400, .fy = 400, .cx = 320, .cy = 240}, 640, 480).value();
  EXPECT_TRUE(recorder->add_camera({}, camera, SE3()));
  for (int s = 1000; s <= 1063; ++s)
    EXPECT_TRUE(recorder->add(Odometry{.stamp = SensorTime(std::chrono::seconds(s))}));
  EXPECT_TRUE(recorder->close());
  const auto log = open_log(memory_source(file));
  const auto report = report_on(**log);
  ASSERT_TRUE(report);
  EXPECT_NEAR(report->duration_s, 63, 1e-9);
  EXPECT_EQ(report->messages, 66U);
}

TEST(LogReport, DetectsABackwardClockJumpIfLogTimeIsTheStamp) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  for (int i = 0; i < 400; ++i) {
    const int ms = 10'000 + 20 * i - (i < 200 ? 0 : 3000);
    EXPECT_TRUE(recorder->add(Odometry{.stamp = SensorTime(std::chrono::milliseconds(ms))}));
  }
  EXPECT_TRUE(recorder->close());
  const auto log = open_log(memory_source(file));
  const auto report = report_on(**log);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->topics.at(0).clock_jumps, 1U);
  EXPECT_NEAR(report->topics.at(0).largest_jump_s, -2.98, 1e-9);
  EXPECT_EQ(report->topics.at(0).stamps.backward(), 1U);
  EXPECT_EQ((*log)->problems().at(0).key, "mcap.time_back");
  std::uint64_t last = 0;  // visit() remains sorted by time and complete
  std::uint64_t messages = 0;
  EXPECT_TRUE((*log)->visit({}, [&](const LogChannel&, const LogMessage& message) {
    EXPECT_GE(message.log_time, last);
    last = message.log_time;
    ++messages;
    return Status();
  }));
  EXPECT_EQ(messages, 400U);
}

TEST(LogReport, StopsOnRequest) {
  const Bytes file = with_jump(0);
  const auto log = open_log(memory_source(file));
  int received = 0;
  const auto report = report_on(**log, [&](std::uint64_t) { return ++received < 10; });
  ASSERT_TRUE(report);
  EXPECT_EQ(report->messages, 10U);
}

TEST(LogReport, ReadsTheStampOfTypesThatBeginWithAHeader) {
  LogChannel channel{.encoding = "cdr"};
  const Bytes message = {0, 1, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0};
  EXPECT_EQ(header_stamp_ns(channel, message), 2'000'000'003U);
  EXPECT_EQ(header_stamp_ns(channel, ByteSpan(message).first(11)), std::nullopt);
}

}  // namespace
}  // namespace waymark

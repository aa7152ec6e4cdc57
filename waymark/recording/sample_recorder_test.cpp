// When a camera's data arrived, as a recording tells it.
#include "waymark/recording/sample_recorder.hpp"

#include <gtest/gtest.h>

#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {
namespace {

SensorTime at_ms(int ms) { return SensorTime(std::chrono::milliseconds(ms)); }

/// Milliseconds from the stamp to the log time of the messages of a topic.
std::vector<double> delays_ms(const std::vector<Sample>& samples, Duration latency = {}) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  recorder->set_camera_latency(latency);
  for (const Sample& sample : samples) EXPECT_TRUE(recorder->add(sample));
  EXPECT_TRUE(recorder->close());
  const auto log = open_log(memory_source(file));
  EXPECT_TRUE(log);
  std::vector<double> delays;
  LogSelection cameras;
  cameras.topics = {topics::kTags};
  const Status status = (*log)->visit(cameras, [&](const LogChannel&, const LogMessage& message) {
    delays.push_back(static_cast<double>(message.log_time - message.publish_time) * 1e-6);
    return Status{};
  });
  EXPECT_TRUE(status);
  return delays;
}

Sample odometry(int ms) { return Odometry{.stamp = at_ms(ms)}; }
Sample tags(int ms) { return TagFrame{.stamp = at_ms(ms)}; }

TEST(SampleRecorder, WhatACameraSawArrivesNoEarlierThanWhatWasRecordedBefore) {
  EXPECT_EQ(delays_ms({odometry(100), tags(60), odometry(120), tags(120), tags(130)}),
            (std::vector<double>{40, 0, 0}));
}

TEST(SampleRecorder, ALatencyThatIsKnownIsTheLeast) {
  EXPECT_EQ(delays_ms({odometry(100), tags(60), tags(100)}, std::chrono::milliseconds(25)),
            (std::vector<double>{40, 25}));
}

TEST(SampleRecorder, AClockThatJumpedSaysNothingOfWhenAPictureArrived) {
  EXPECT_EQ(delays_ms({odometry(100'000), tags(60), odometry(80), tags(70)}), (std::vector<double>{0, 10}));
}

}  // namespace
}  // namespace waymark

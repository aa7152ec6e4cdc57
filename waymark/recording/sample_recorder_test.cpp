// Tests of the arrival times of camera data in a recording.
#include "waymark/recording/sample_recorder.hpp"

#include <gtest/gtest.h>

#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {
namespace {

SensorTime at_ms(int ms) { return SensorTime(std::chrono::milliseconds(ms)); }

/// Milliseconds from the stamp to the log time of the messages on a topic.
std::vector<double> arrival_delays_ms(const std::vector<Sample>& samples, Duration arrival_delay = {}) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  recorder->set_image_arrival_delay(arrival_delay);
  for (const Sample& sample : samples) EXPECT_TRUE(recorder->add(sample));
  EXPECT_TRUE(recorder->close());
  const auto log = open_log(memory_source(file));
  EXPECT_TRUE(log);
  std::vector<double> arrival_delays;
  LogSelection cameras;
  cameras.topics = {topics::kTags};
  const Status status = (*log)->visit(cameras, [&](const LogChannel&, const LogMessage& message) {
    arrival_delays.push_back(static_cast<double>(message.log_time - message.publish_time) * 1e-6);
    return Status{};
  });
  EXPECT_TRUE(status);
  return arrival_delays;
}

Sample odometry(int ms) { return Odometry{.stamp = at_ms(ms)}; }
Sample tags(int ms) { return TagFrame{.stamp = at_ms(ms)}; }

TEST(SampleRecorder, CameraDataArriveAfterSamplesRecordedBefore) {
  EXPECT_EQ(arrival_delays_ms({odometry(100), tags(60), odometry(120), tags(120), tags(130)}),
            (std::vector<double>{40, 0, 0}));
}

TEST(SampleRecorder, TheConfiguredDelayIsTheMinimum) {
  EXPECT_EQ(arrival_delays_ms({odometry(100), tags(60), tags(100)}, std::chrono::milliseconds(25)),
            (std::vector<double>{40, 25}));
}

TEST(SampleRecorder, AClockJumpDoesNotDelayImages) {
  EXPECT_EQ(arrival_delays_ms({odometry(100'000), tags(60), odometry(80), tags(70)}),
            (std::vector<double>{0, 10}));
}

/// Records one image and reads it again.
std::vector<CameraFrame> recorded(const CameraFrame& image, const std::string& how) {
  Bytes bytes;
  auto recorder = SampleRecorder::open(memory_sink(bytes));
  EXPECT_TRUE(recorder);
  EXPECT_TRUE(record_image(image, how, *recorder));
  EXPECT_TRUE(recorder->add(Odometry{.stamp = image.stamp}));
  EXPECT_TRUE(recorder->close());
  std::vector<CameraFrame> images;
  auto log = open_log(memory_source(bytes));
  EXPECT_TRUE(log);
  EXPECT_TRUE((*log)->visit_samples({}, [&](const Sample& sample) {
    if (const auto* frame = std::get_if<CameraFrame>(&sample)) images.push_back(*frame);
    return Status();
  }));
  return images;
}

TEST(RecordImage, RawIsExactJpegIsCloseAndEmptyRecordsNothing) {
  CameraFrame frame{.stamp = SensorTime(std::chrono::seconds(3)), .image = Image(64, 48)};
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) frame.image.row(y)[x] = static_cast<std::uint8_t>(2 * x + y);
  EXPECT_TRUE(recorded(frame, "").empty());
  for (const char* how : {"raw", "jpeg"}) {
    const auto back = recorded(frame, how);
    ASSERT_EQ(back.size(), 1U) << how;
    EXPECT_EQ(back[0].stamp, frame.stamp);
    ASSERT_EQ(back[0].image.width(), 64);
    ASSERT_EQ(back[0].image.height(), 48);
    int worst = 0;
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x)
        worst = std::max(worst, std::abs(back[0].image.row(y)[x] - frame.image.row(y)[x]));
    EXPECT_LE(worst, std::string(how) == "raw" ? 0 : 8) << how;
  }
}

}  // namespace
}  // namespace waymark

#include "waymark/recording/picture_recording.hpp"

#include <gtest/gtest.h>

#include "waymark/recording/message_log.hpp"

namespace waymark {
namespace {

/// A recording of one picture; what of it comes back.
std::vector<CameraFrame> recorded(const CameraFrame& picture, const std::string& how) {
  Bytes bytes;
  auto recorder = SampleRecorder::open(memory_sink(bytes));
  EXPECT_TRUE(recorder);
  EXPECT_TRUE(record_picture(picture, how, *recorder));
  EXPECT_TRUE(recorder->add(Odometry{.stamp = picture.stamp}));
  EXPECT_TRUE(recorder->close());
  std::vector<CameraFrame> pictures;
  auto log = open_log(memory_source(bytes));
  EXPECT_TRUE(log);
  EXPECT_TRUE((*log)->visit_samples({}, [&](const Sample& sample) {
    if (const auto* frame = std::get_if<CameraFrame>(&sample)) pictures.push_back(*frame);
    return Status();
  }));
  return pictures;
}

TEST(RecordPicture, RawIsToTheByteJpegNearlyAndNothingIsNothing) {
  CameraFrame picture{.stamp = SensorTime(std::chrono::seconds(3)), .image = Image(64, 48)};
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) picture.image.row(y)[x] = static_cast<std::uint8_t>(2 * x + y);
  EXPECT_TRUE(recorded(picture, "").empty());
  for (const char* how : {"raw", "jpeg"}) {
    const auto back = recorded(picture, how);
    ASSERT_EQ(back.size(), 1U) << how;
    EXPECT_EQ(back[0].stamp, picture.stamp);
    ASSERT_EQ(back[0].image.width(), 64);
    ASSERT_EQ(back[0].image.height(), 48);
    int worst = 0;
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x)
        worst = std::max(worst, std::abs(back[0].image.row(y)[x] - picture.image.row(y)[x]));
    EXPECT_LE(worst, std::string(how) == "raw" ? 0 : 8) << how;
  }
}

}  // namespace
}  // namespace waymark

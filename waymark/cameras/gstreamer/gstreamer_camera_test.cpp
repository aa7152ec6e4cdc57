#include "waymark/cameras/gstreamer/gstreamer_camera.hpp"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace waymark {
namespace {

using ::testing::HasSubstr;

#ifdef WAYMARK_HAVE_GSTREAMER

std::unique_ptr<GstreamerCamera> open(const std::string& pipeline) {
  auto camera = GstreamerCamera::open(pipeline);
  EXPECT_TRUE(camera) << (camera ? "" : to_string(camera.error()));
  return camera ? std::move(*camera) : nullptr;
}

/// All images up to the end of the pipeline.
std::vector<CameraFrame> all_images(GstreamerCamera& camera) {
  std::vector<CameraFrame> images;
  while (!camera.ended()) {
    auto event = camera.next(std::chrono::milliseconds(500));
    if (!event) {
      ADD_FAILURE() << to_string(event.error());
      break;
    }
    if (!*event) continue;
    if (auto* sample = std::get_if<Sample>(&**event))
      images.push_back(std::get<CameraFrame>(std::move(*sample)));
  }
  return images;
}

/// The images are 30 px wide, so that GStreamer pads the rows.
TEST(GstreamerCameraThreads, DeliversTheImagesOfAFile) {
  constexpr int kHeight = 20;
  constexpr int kStride = 32;
  const auto path = std::filesystem::temp_directory_path() / ("gst_" + std::to_string(getpid()));
  std::ofstream file(path, std::ios::binary);
  for (int image = 0; image < 10; ++image)
    for (int i = 0; i < kStride * kHeight; ++i) file.put(static_cast<char>(60 + image + i % kStride));
  file.close();
  auto camera = open("filesrc location=" + path.string() +
                     " ! rawvideoparse width=30 height=20 format=gray8 framerate=50/1");
  ASSERT_NE(camera, nullptr);
  const auto images = all_images(*camera);
  std::filesystem::remove(path);
  ASSERT_GE(images.size(), 3U);  // a busy computer may deliver only the newest ones
  EXPECT_THAT(camera->description(), HasSubstr("30 x 20 px"));
  for (const CameraFrame& frame : images) {
    const int first = frame.image.view().at(0, 0);
    EXPECT_EQ(frame.image.view().at(7, 11), first + 7);
    const double due_s = 0.02 * (first - images.front().image.view().at(0, 0));
    EXPECT_NEAR(to_seconds(frame.stamp - images.front().stamp), due_s, 2e-3);
  }
}

TEST(GstreamerCameraThreads, StampsALiveSourceByTheSteadyClock) {
  auto camera =
      open("videotestsrc is-live=true num-buffers=10 ! video/x-raw,width=64,height=48,framerate=30/1");
  ASSERT_NE(camera, nullptr);
  const auto before = std::chrono::steady_clock::now().time_since_epoch();
  const auto images = all_images(*camera);
  const auto after = std::chrono::steady_clock::now().time_since_epoch();
  ASSERT_GE(images.size(), 3U);
  for (const CameraFrame& frame : images) {
    EXPECT_GT(frame.stamp.time_since_epoch(), before - std::chrono::milliseconds(500));
    EXPECT_LT(frame.stamp.time_since_epoch(), after);
  }
}

TEST(GstreamerCamera, ReportsInvalidPipelinesAndMissingFiles) {
  const auto unknown = GstreamerCamera::open("nosuchsource");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(unknown.error().message, HasSubstr("nosuchsource"));
  const auto missing =
      GstreamerCamera::open("filesrc location=/nowhere ! rawvideoparse width=8 height=8 format=gray8");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::Unreadable);
  EXPECT_THAT(missing.error().message, HasSubstr("/nowhere"));
}

#else

TEST(GstreamerCamera, IsUnsupportedInABuildWithoutGstreamer) {
  const auto camera = GstreamerCamera::open("videotestsrc");
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().code, ErrorCode::Unsupported);
}

#endif

}  // namespace
}  // namespace waymark

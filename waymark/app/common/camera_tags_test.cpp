#include "waymark/app/common/camera_tags.hpp"

#include <csignal>
#include <filesystem>

#include <sys/resource.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// Limits the size of files during its lifetime, so that writing fails as it does on a full disk.
class LargestFile {
 public:
  explicit LargestFile(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{.rlim_cur = bytes, .rlim_max = before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~LargestFile() {
    setrlimit(RLIMIT_FSIZE, &before_);
    (void)std::signal(SIGXFSZ, handler_);
  }
  LargestFile(const LargestFile&) = delete;
  LargestFile& operator=(const LargestFile&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

/// An image of noise, which does not compress.
Image noise(int width, int height) {
  Random random(20261126);
  Image image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<std::uint8_t>(random.uniform(0, 255.999));
  return image;
}

TEST(ConvertVideo, AFullDiskIsAnErrorAndLeavesNoFile) {
  const fs::path folder = testing::fresh_folder("jobs_convert_video");
  const ConvertVideoJob job{.output = (folder / "lap.mcap").string(), .images = "raw"};
  const Image image = noise(640, 480);
  Status written;
  {
    const LargestFile limit(1'000'000);
    written = record_tags(job, "camera", [&](const TakeTagImage& take) -> Status {
      Status status;
      for (int k = 0; status && k < 50; ++k)
        status = take(image.view(), TagFrame{.stamp = SensorTime(std::chrono::milliseconds(33 * k))});
      return status;
    });
  }
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().place.source, job.output);
  EXPECT_EQ(written.error().hint, "Free some space; nothing was written.");
  EXPECT_TRUE(fs::is_empty(folder));
}

}  // namespace
}  // namespace waymark

#include "waymark/media/video_format.hpp"

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <unistd.h>

namespace waymark {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;

class VideoNames : public ::testing::Test {
 protected:
  VideoNames() { fs::create_directories(folder_); }
  ~VideoNames() override { fs::remove_all(folder_); }
  std::string file(const std::string& name, std::string_view bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return (folder_ / name).string();
  }
  fs::path folder_ = fs::temp_directory_path() / ("waymark-video-names-" + std::to_string(getpid()));
};

TEST_F(VideoNames, AVideoIsRecognisedByItsFirstBytesNotItsName) {
  EXPECT_TRUE(looks_like_video(file("a",
                                    "\0\0\0\x18"
                                    "ftypmp42"sv)));
  EXPECT_TRUE(looks_like_video(file("b.bin", "\x1A\x45\xDF\xA3 matroska"sv)));
  EXPECT_TRUE(looks_like_video(file("c", "RIFF\0\0\0\0AVI LIST"sv)));
  EXPECT_FALSE(looks_like_video(file("d", "RIFF\0\0\0\0WEBPVP8 "sv))) << "an image in the same container";
  EXPECT_FALSE(looks_like_video(file("e.heic",
                                     "\0\0\0\x18"
                                     "ftypheic"sv)));
}

TEST_F(VideoNames, AFileWithTheNameOfAVideoIsLeftToTheReader) {
  for (const char* name : {"empty.mp4", "cut.mkv", "torn.avi", "none.webm"}) {
    EXPECT_TRUE(looks_like_video(file(name, ""))) << name;
    EXPECT_TRUE(looks_like_video(file(name, "no video at all"))) << name;
  }
  EXPECT_FALSE(looks_like_video(file("picture.png", "no video at all")));
}

TEST_F(VideoNames, OnlyRegularFilesAreRead) {
  EXPECT_FALSE(looks_like_video(folder_.string()));
  EXPECT_FALSE(looks_like_video((folder_ / "none.mp4").string()));
  EXPECT_FALSE(looks_like_video("/dev/zero"));
}

}  // namespace
}  // namespace waymark

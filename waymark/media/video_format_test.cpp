#include "waymark/media/video_format.hpp"

#include <string_view>

#include <gtest/gtest.h>

namespace waymark {
namespace {

using namespace std::string_view_literals;

bool begins(std::string_view head) {
  return begins_as_video({reinterpret_cast<const std::uint8_t*>(head.data()), head.size()});
}

TEST(VideoFormat, AVideoIsRecognisedByItsFirstBytes) {
  EXPECT_TRUE(
      begins("\0\0\0\x18"
             "ftypmp42"sv));
  EXPECT_TRUE(begins("\x1A\x45\xDF\xA3 matroska"sv));
  EXPECT_TRUE(begins("RIFF\0\0\0\0AVI LIST"sv));
  EXPECT_FALSE(begins("RIFF\0\0\0\0WEBPVP8 "sv)) << "an image in the same container";
  EXPECT_FALSE(
      begins("\0\0\0\x18"
             "ftypheic"sv));
  EXPECT_FALSE(begins(""));
  EXPECT_FALSE(begins("no video at all"));
}

TEST(VideoFormat, AFileWithTheNameOfAVideoIsReadAsOne) {
  for (const char* name : {"empty.mp4", "cut.MKV", "folder/torn.avi", "none.webm"}) {
    EXPECT_TRUE(is_video_name(name)) << name;
    EXPECT_TRUE(has_video_ending(name)) << name;
  }
  EXPECT_TRUE(has_video_ending("raw.h264"));
  EXPECT_FALSE(is_video_name("raw.h264")) << "no such file is written";
  EXPECT_FALSE(has_video_ending("image.png"));
  EXPECT_FALSE(has_video_ending("mp4"));
}

}  // namespace
}  // namespace waymark

// Writes videos from known images and reads them back, intact, truncated or damaged. Also reads files that
// are not videos.
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/media/video_format.hpp"
#include "waymark/media/video_reader.hpp"
#include "waymark/media/video_writer.hpp"

#ifndef WAYMARK_HAVE_LIBAV

TEST(Video, WithoutTheLibrariesTheErrorNamesThePackages) {
  const auto reader = waymark::VideoReader::open("walk.mp4");
  ASSERT_FALSE(reader);
  EXPECT_NE(reader.error().hint.find("libavformat-dev"), std::string::npos);
}

#else

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kWidth = 160;
constexpr int kHeight = 120;

/// Image k of a video: a gradient with a moving bright block.
Image image_of_step(int k, int width = kWidth, int height = kHeight) {
  Image image(width, height);
  const int left = 10 + 7 * k % (width - 50);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool block = x >= left && x < left + 32 && y >= 40 && y < 72;
      image.row(y)[x] = static_cast<std::uint8_t>(block ? 220 : 40 + x / 2 + y / 4);
    }
  }
  return image;
}

double mean_difference(const ImageView& a, const ImageView& b) {
  if (a.width != b.width || a.height != b.height) return 255;
  double sum = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) sum += std::abs(int{a.at(x, y)} - int{b.at(x, y)});
  return sum / a.width / a.height;
}

/// Stamps are unevenly spaced.
SensorTime stamp_of(int k) { return SensorTime(std::chrono::milliseconds(1000 + 40 * k + 7 * (k % 3))); }

Status write(const fs::path& path, int images, const VideoWriterOptions& options = {}, int width = kWidth,
             int height = kHeight, const std::function<SensorTime(int)>& stamp = stamp_of) {
  auto writer = VideoWriter::create(path, width, height, options);
  if (!writer) return tl::unexpected(writer.error());
  for (int k = 0; k < images; ++k)
    if (Status added = writer->add(image_of_step(k, width, height).view(), stamp(k)); !added) return added;
  return writer->close();
}

struct Seen {
  std::vector<SensorTime> stamps{};
  std::vector<double> differences{};  ///< difference of each image from the one written for its time
  std::vector<VideoProblem> problems{};

  [[nodiscard]] std::string text_of(const std::string& key) const {
    for (const VideoProblem& problem : problems)
      if (problem.key == key) return to_string(problem.error);
    return {};
  }
};

/// Reads to the end. `index_at` returns the number of the image with a given stamp.
Seen read(VideoReader& reader, const std::function<int(SensorTime)>& index_at, int width = kWidth,
          int height = kHeight) {
  Seen seen;
  while (true) {
    const auto frame = reader.next();
    EXPECT_TRUE(frame) << to_string(frame.error());
    if (!frame || !*frame) break;
    seen.stamps.push_back((*frame)->stamp);
    seen.differences.push_back(
        mean_difference((*frame)->luma, image_of_step(index_at((*frame)->stamp), width, height)));
  }
  seen.problems = reader.problems();
  return seen;
}

/// The image whose stamp, relative to the first, is nearest.
int nearest(SensorTime stamp) {
  int best = 0;
  const Duration since = stamp.time_since_epoch();
  for (int k = 0; k < 200; ++k)
    if (std::chrono::abs(stamp_of(k) - stamp_of(0) - since) <
        std::chrono::abs(stamp_of(best) - stamp_of(0) - since))
      best = k;
  return best;
}

std::vector<std::uint8_t> bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void write_bytes(const fs::path& path, std::span<const std::uint8_t> bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

struct Kind {
  const char* name;
  VideoCodec codec;
  const char* suffix;
  const char* codec_name;
};

class EveryKind : public ::testing::TestWithParam<Kind> {};

TEST_P(EveryKind, ImagesAndStampsRoundTrip) {
  const Kind& kind = GetParam();
  const fs::path folder = testing::fresh_folder(std::string("video_") + kind.name);
  const fs::path path = folder / (std::string("walk") + kind.suffix);
  const bool steady = std::string(kind.suffix) == ".avi";  // .avi has no stamps
  const auto stamp = [&](int k) {
    return steady ? SensorTime(std::chrono::milliseconds(1000 + 40 * k)) : stamp_of(k);
  };
  constexpr int kImages = 20;
  // One side is odd.
  const Status written =
      write(path, kImages, {.codec = kind.codec, .quality = 15, .rate_hz = 25}, kWidth + 1, kHeight, stamp);
  ASSERT_TRUE(written) << to_string(written.error());
  std::array<char, 400> head{};
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), head.size());
  EXPECT_TRUE(begins_as_video(
      {reinterpret_cast<const std::uint8_t*>(head.data()), static_cast<std::size_t>(file.gcount())}));
  auto reader = VideoReader::open(path);
  ASSERT_TRUE(reader) << to_string(reader.error());
  EXPECT_EQ(reader->info().codec, kind.codec_name);
  EXPECT_EQ(reader->info().width_px, kWidth + 2);
  EXPECT_EQ(reader->info().height_px, kHeight);
  ASSERT_TRUE(reader->info().duration);
  int k = 0;
  while (true) {
    const auto frame = reader->next();
    ASSERT_TRUE(frame) << to_string(frame.error());
    if (!*frame) break;
    const Duration off = ((*frame)->stamp - SensorTime()) - (stamp(k) - stamp(0));
    EXPECT_LE(std::abs(to_seconds(off)), 0.0011) << k;
    const ImageView part{(*frame)->luma.data, kWidth + 1, kHeight, (*frame)->luma.stride};
    EXPECT_LT(mean_difference(part, image_of_step(k, kWidth + 1)), 3) << k;
    EXPECT_EQ((*frame)->index, k);
    ++k;
  }
  EXPECT_EQ(k, kImages);
  EXPECT_TRUE(reader->problems().empty()) << to_string(reader->problems().front().error);
}

INSTANTIATE_TEST_SUITE_P(All, EveryKind,
                         ::testing::Values(Kind{"H264Mp4", VideoCodec::H264, ".mp4", "h264"},
                                           Kind{"H264Mkv", VideoCodec::H264, ".mkv", "h264"},
                                           Kind{"HevcMp4", VideoCodec::Hevc, ".mp4", "hevc"},
                                           Kind{"Vp9Webm", VideoCodec::Vp9, ".webm", "vp9"},
                                           Kind{"Av1Mkv", VideoCodec::Av1, ".mkv", "av1"},
                                           Kind{"MjpegAvi", VideoCodec::Mjpeg, ".avi", "mjpeg"},
                                           Kind{"MjpegMov", VideoCodec::Mjpeg, ".mov", "mjpeg"},
                                           Kind{"H264Avi", VideoCodec::H264, ".avi", "h264"}),
                         [](const auto& of) { return of.param.name; });

TEST(Video, TheRotationFlagIsReportedAndPixelsAreUnchanged) {
  const fs::path path = testing::fresh_folder("video_rotation") / "phone.mp4";
  ASSERT_TRUE(write(path, 3, {.rotation_deg = 90}));
  auto reader = VideoReader::open(path);
  ASSERT_TRUE(reader);
  EXPECT_NEAR(reader->info().rotation_deg, 90, 1e-6);
  const Seen seen = read(*reader, nearest);
  ASSERT_EQ(seen.stamps.size(), 3U);
  EXPECT_LT(seen.differences[0], 3);
  EXPECT_THAT(seen.text_of("video.rotated"), HasSubstr("90 degrees"));
  testing::expect_on_page("files", seen.text_of("video.rotated"));
}

TEST(Video, ColorsBecomeGrey) {
  const fs::path path = testing::fresh_folder("video_color") / "color.mp4";
  auto writer = VideoWriter::create(path, 64, 48, {.quality = 5});
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->add(ColorImage(64, 48, Rgb{200, 50, 30}), stamp_of(0)));
  ASSERT_TRUE(writer->close());
  auto reader = VideoReader::open(path);
  ASSERT_TRUE(reader);
  const auto frame = reader->next();
  ASSERT_TRUE(frame && *frame);
  EXPECT_NEAR((*frame)->luma.at(30, 20), (299 * 200 + 587 * 50 + 114 * 30) / 1000, 2);
}

TEST(Video, AGapInTimeIsReported) {
  const fs::path path = testing::fresh_folder("video_gap") / "gap.mp4";
  const auto stamp = [](int k) {
    return SensorTime(std::chrono::milliseconds(k < 5 ? 40 * k : 3000 + 40 * k));
  };
  ASSERT_TRUE(write(path, 10, {}, kWidth, kHeight, stamp));
  auto reader = VideoReader::open(path);
  ASSERT_TRUE(reader);
  const Seen seen = read(*reader, [](SensorTime) { return 0; });
  EXPECT_EQ(seen.stamps.size(), 10U);
  EXPECT_THAT(seen.text_of("video.gap"), HasSubstr("0.160 s and 3.200 s"));
  testing::expect_on_page("files", seen.text_of("video.gap"));
}

TEST(Video, ATruncatedFileIsReadToItsEndAndReported) {
  const fs::path folder = testing::fresh_folder("video_cut");
  for (const char* name : {"walk.mkv", "walk.avi"}) {
    ASSERT_TRUE(write(folder / name, 100, {.rate_hz = 25}));
    const auto bytes = bytes_of(folder / name);
    write_bytes(folder / name, std::span(bytes).first(bytes.size() / 2));
    auto reader = VideoReader::open(folder / name);
    ASSERT_TRUE(reader) << to_string(reader.error());
    const Seen seen = read(*reader, [&](SensorTime stamp) {
      return std::string(name) == "walk.avi"
                 ? static_cast<int>(std::lround(to_seconds(stamp - SensorTime()) * 25))
                 : nearest(stamp);
    });
    EXPECT_GT(seen.stamps.size(), 20U) << name;
    EXPECT_LT(seen.stamps.size(), 90U) << name;
    for (const double difference : seen.differences) EXPECT_LT(difference, 4) << name;
    EXPECT_THAT(seen.text_of("video.truncated"), HasSubstr((folder / name).string()));
    testing::expect_on_page("files", seen.text_of("video.truncated"));
  }
}

TEST(Video, AnMp4WithoutItsIndexIsUnreadable) {
  const fs::path path = testing::fresh_folder("video_index") / "walk.mp4";
  ASSERT_TRUE(write(path, 60));
  const auto bytes = bytes_of(path);
  write_bytes(path, std::span(bytes).first(bytes.size() / 2));
  const auto reader = VideoReader::open(path);
  ASSERT_FALSE(reader);
  EXPECT_EQ(reader.error().code, ErrorCode::Unreadable);
  EXPECT_FALSE(reader.error().hint.empty());
  EXPECT_TRUE(reader.error().place.byte);
}

TEST(Video, ImagesAfterDamageAreSkippedUntilTheNextIntactOne) {
  const fs::path folder = testing::fresh_folder("video_hole");
  for (const char* name : {"walk.mp4", "walk.mkv"}) {
    // No images between key frames are predicted from later ones.
    ASSERT_TRUE(write(folder / name, 150, {.quality = 20, .key_interval = 25}));
    const auto whole = bytes_of(folder / name);
    for (int hole = 0; hole < 8; ++hole) {  // within an image, across its edges, across several images
      const std::string where = fmt::format("{}, hole {}", name, hole);
      auto bytes = whole;
      const std::size_t first = bytes.size() * 2 / 5 + static_cast<std::size_t>(hole) * 97;
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(first), bytes.size() / 40, std::uint8_t{0});
      auto reader = VideoReader::open(bytes, name);
      ASSERT_TRUE(reader) << to_string(reader.error());
      const Seen seen = read(*reader, nearest);
      EXPECT_GT(seen.stamps.size(), 60U) << where;
      EXPECT_LT(seen.stamps.size(), 150U) << where;
      for (std::size_t i = 0; i < seen.differences.size(); ++i)
        EXPECT_LT(seen.differences[i], 4) << where << " at " << to_seconds(seen.stamps[i] - SensorTime());
      EXPECT_NE(seen.text_of("video.damaged"), "") << where;
      EXPECT_GT(to_seconds(seen.stamps.back() - SensorTime()), 5.9)
          << where;  // reading continues after the damage
    }
  }
}

// All later images are predicted from damaged ones, and the file has its full length.
TEST(Video, AFileWithoutIntactImagesAfterDamageIsNotReportedAsTruncated) {
  const fs::path path = testing::fresh_folder("video_hole_to_end") / "walk.mp4";
  auto writer = VideoWriter::create(path, kWidth, kHeight, {.quality = 20, .key_interval = 10000});
  ASSERT_TRUE(writer) << to_string(writer.error());
  for (int k = 0; k < 150; ++k)  // moves back and forth, because a jump would create a key frame
    ASSERT_TRUE(writer->add(image_of_step(std::abs(k % 12 - 6)).view(), stamp_of(k)));
  ASSERT_TRUE(writer->close());
  auto bytes = bytes_of(path);
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() * 2 / 5), bytes.size() / 40,
              std::uint8_t{0});
  auto reader = VideoReader::open(bytes, "walk.mp4");
  ASSERT_TRUE(reader) << to_string(reader.error());
  const Seen seen = read(*reader, nearest);
  EXPECT_LT(to_seconds(seen.stamps.back() - SensorTime()), 4);
  EXPECT_NE(seen.text_of("video.damaged"), "");
  EXPECT_EQ(seen.text_of("video.truncated"), "");
  EXPECT_THAT(seen.text_of("video.no_whole_image"), HasSubstr("6.007 s"));
  testing::expect_on_page("files", seen.text_of("video.no_whole_image"));
}

TEST(Video, FilesThatAreNotVideosAreErrors) {
  const fs::path folder = testing::fresh_folder("video_none");
  const auto expect_error = [&](const fs::path& path, ErrorCode code) {
    const auto reader = VideoReader::open(path);
    ASSERT_FALSE(reader) << path;
    EXPECT_EQ(reader.error().code, code) << path;
    EXPECT_EQ(reader.error().place.source, path.string());
    testing::expect_on_page("files", reader.error());
  };
  expect_error(folder / "absent.mp4", ErrorCode::NotFound);
  expect_error(folder, ErrorCode::Unreadable);
  write_bytes(folder / "empty.mp4", {});
  expect_error(folder / "empty.mp4", ErrorCode::Unreadable);
  std::ofstream(folder / "text.mp4") << std::string(5000, 'x');
  expect_error(folder / "text.mp4", ErrorCode::Unreadable);
  ASSERT_EQ(::mkfifo((folder / "pipe.mp4").c_str(), 0600), 0);
  expect_error(folder / "pipe.mp4", ErrorCode::Unsupported);
  expect_error("/dev/null", ErrorCode::Unsupported);
  std::ofstream(folder / "list.mp4") << "#EXTM3U\n#EXTINF:1,\nfile:///etc/passwd\n";
  expect_error(folder / "list.mp4", ErrorCode::Unreadable);
}

TEST(Video, AnImageInTheSameContainerIsNotAVideo) {
  const auto begins = [](std::string_view head) {
    return begins_as_video({reinterpret_cast<const std::uint8_t*>(head.data()), head.size()});
  };
  using namespace std::string_view_literals;
  EXPECT_TRUE(
      begins("\0\0\0\x20"
             "ftypisom\0\0\2\0"sv));
  EXPECT_FALSE(
      begins("\0\0\0\x20"
             "ftypheic\0\0\0\0"sv));
  EXPECT_FALSE(begins("\x89PNG\r\n\x1a\n"sv));
}

TEST(Video, AFileWithOnlySoundIsAnError) {
  const fs::path path = testing::fresh_folder("video_sound") / "sound.mp4";
  std::string wave = "RIFF";
  const auto number = [&](std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) wave += static_cast<char>(value >> (8 * i) & 255U);
  };
  constexpr std::uint32_t kSamples = 8000;
  number(36 + kSamples, 4);
  wave += "WAVEfmt ";
  number(16, 4), number(1, 2), number(1, 2), number(8000, 4), number(8000, 4), number(1, 2), number(8, 2);
  wave += "data";
  number(kSamples, 4);
  wave += std::string(kSamples, '\x80');
  std::ofstream(path, std::ios::binary) << wave;
  const auto reader = VideoReader::open(path);
  ASSERT_FALSE(reader);
  EXPECT_EQ(reader.error().code, ErrorCode::Unreadable);
  testing::expect_on_page("files", reader.error());
}

TEST(Video, LargeImagesAreRejected) {
  const fs::path path = testing::fresh_folder("video_large") / "walk.mp4";
  ASSERT_TRUE(write(path, 2));
  const auto reader = VideoReader::open(path, {.max_pixels = kWidth * kHeight - 1});
  ASSERT_FALSE(reader);
  EXPECT_EQ(reader.error().code, ErrorCode::LimitExceeded);
}

TEST(Video, DamagedBytesNeverCrash) {
  const fs::path folder = testing::fresh_folder("video_bytes");
  Random random(20261123);
  for (const char* name : {"walk.mp4", "walk.mkv", "walk.webm", "walk.avi"}) {
    ASSERT_TRUE(write(folder / name, 8));
    const auto whole = bytes_of(folder / name);
    for (int round = 0; round < 40; ++round) {
      auto bytes = whole;
      for (int flip = 0; flip < 1 + round; ++flip) {
        const auto at =
            static_cast<std::size_t>(random.uniform(0, 1) * static_cast<double>(bytes.size() - 1));
        bytes[at] = static_cast<std::uint8_t>(random.uniform(0, 256));
      }
      auto reader = VideoReader::open(bytes, name, {.max_pixels = 1'000'000});
      if (!reader) continue;
      std::optional<SensorTime> last;
      for (int k = 0; k < 100; ++k) {
        const auto frame = reader->next();
        if (!frame || !*frame) break;
        ASSERT_FALSE((*frame)->luma.empty());
        EXPECT_TRUE(!last || (*frame)->stamp > *last);
        last = (*frame)->stamp;
      }
    }
  }
}

TEST(Video, AWriterThatIsNotClosedLeavesNoFile) {
  const fs::path folder = testing::fresh_folder("video_unfinished");
  {
    auto writer = VideoWriter::create(folder / "walk.mp4", kWidth, kHeight);
    ASSERT_TRUE(writer);
    ASSERT_TRUE(writer->add(image_of_step(0).view(), stamp_of(0)));
    const Status again = writer->add(image_of_step(1).view(), stamp_of(0));
    ASSERT_FALSE(again);
    EXPECT_EQ(again.error().code, ErrorCode::InvalidArgument);
    testing::expect_on_page("files", again.error());
    EXPECT_FALSE(fs::exists(folder / "walk.mp4"));
  }
  EXPECT_TRUE(fs::is_empty(folder));
}

TEST(Video, UnwritableVideosAreErrors) {
  const fs::path folder = testing::fresh_folder("video_unwritable");
  const auto expect_error = [&](const fs::path& path, int width, ErrorCode code) {
    const auto writer = VideoWriter::create(path, width, kHeight);
    ASSERT_FALSE(writer) << path;
    EXPECT_EQ(writer.error().code, code) << path;
    testing::expect_on_page("files", writer.error());
  };
  expect_error(folder / "walk.gif", kWidth, ErrorCode::InvalidArgument);
  expect_error(folder / "walk.mp4", 0, ErrorCode::InvalidArgument);
  expect_error(folder / "absent" / "walk.mp4", kWidth, ErrorCode::Unwritable);
}

}  // namespace
}  // namespace waymark

#endif

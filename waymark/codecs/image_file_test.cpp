#include "waymark/codecs/image_file.hpp"

#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

Image noise(int width, int height) {
  Random random(5);
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<std::uint8_t>(random.index(256));
  }
  return image;
}

TEST(ImageFile, RoundTripsBySuffixInAnyCase) {
  const fs::path folder = testing::fresh_folder("files");
  const Image image = noise(40, 30);
  for (const char* name : {"a.png", "b.pgm", "c.pnm", "d.PNG", "e.Pgm"}) {
    ASSERT_TRUE(write_image(folder / name, image)) << name;
    const Result<Image> back = read_image(folder / name);
    ASSERT_TRUE(back) << to_string(back.error());
    EXPECT_EQ(*back, image);
  }
  for (const char* name : {"a.jpg", "b.JPEG"}) {
    ASSERT_TRUE(write_image(folder / name, image));
    EXPECT_EQ(probe_image(folder / name)->format, ImageFormat::Jpeg);
  }
  for (const char* name : {"c.ppm", "c.png", "c.jpg", "c.pnm"}) {
    ASSERT_TRUE(write_image(folder / name, to_color(image)));
    EXPECT_EQ(probe_image(folder / name)->channels, 3);
  }
}

TEST(ImageFile, ContentNotSuffixDeterminesTheFormat) {
  const fs::path folder = testing::fresh_folder("content");
  const Image image = noise(10, 10);
  ASSERT_TRUE(write_bytes(folder / "really.jpg", encode_png(image).value()));
  EXPECT_EQ(read_image(folder / "really.jpg").value(), image);
}

TEST(ImageFile, InvalidSuffixesAreRejectedWithAlternatives) {
  const fs::path folder = testing::fresh_folder("suffix");
  const Image image = noise(4, 4);
  const Status unknown = write_image(folder / "a.tiff", image);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(unknown.error().message, HasSubstr("'.tiff'"));
  EXPECT_THAT(unknown.error().hint, HasSubstr(".png"));
  testing::expect_on_page("files", unknown.error());
  testing::expect_on_page("files", write_image(folder / "a", image).error());
  EXPECT_THAT(write_image(folder / "a.pgm", to_color(image)).error().hint, HasSubstr(".ppm"));
  EXPECT_THAT(write_image(folder / "a.ppm", image).error().hint, HasSubstr(".pgm"));
  testing::expect_on_page("files", write_image(folder / "a.ppm", image).error());
  const Status empty = write_image(folder / "a.png", Image());
  ASSERT_FALSE(empty);
  EXPECT_THAT(empty.error().place.source, HasSubstr("a.png"));
  EXPECT_TRUE(fs::is_empty(folder));
}

TEST(ImageFile, UnreadableFilesAreErrors) {
  const fs::path folder = testing::fresh_folder("unreadable");
  EXPECT_EQ(read_image(folder / "none.png").error().code, ErrorCode::NotFound);
  EXPECT_EQ(read_image(folder / "none.png").error().place.source, (folder / "none.png").string());
  EXPECT_EQ(read_image(folder).error().code, ErrorCode::Unreadable);
  testing::expect_on_page("files", read_image(folder).error());
  std::ofstream(folder / "empty.png").close();
  EXPECT_EQ(read_image(folder / "empty.png").error().code, ErrorCode::Unreadable);
  testing::expect_on_page("files", read_image(folder / "empty.png").error());
  std::ofstream(folder / "text.png") << "not an image";
  EXPECT_EQ(read_image(folder / "text.png").error().code, ErrorCode::Unreadable);
  EXPECT_EQ(read_image(folder / "text.png").error().place.byte, 0);
  testing::expect_on_page("files", read_image(folder / "text.png").error());
  ASSERT_TRUE(write_image(folder / "a.png", noise(4, 4)));
  EXPECT_EQ(read_image(folder / "a.png" / "b.png").error().code, ErrorCode::NotFound);
}

TEST(ImageFile, AnEndlessFileIsNotReadToItsEnd) {
  if (!fs::exists("/dev/zero")) GTEST_SKIP() << "no /dev/zero here";
  EXPECT_EQ(read_image("/dev/zero").error().code, ErrorCode::Unreadable);
}

TEST(ImageFile, UnwritableFilesAreErrors) {
  const fs::path folder = testing::fresh_folder("unwritable");
  const Status missing = write_image(folder / "no" / "such" / "a.png", noise(4, 4));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::Unwritable);
  testing::expect_on_page("files", missing.error());
  fs::create_directory(folder / "folder.png");
  EXPECT_EQ(write_image(folder / "folder.png", noise(4, 4)).error().code, ErrorCode::Unwritable);
}

TEST(ImageFile, AFullDiskIsReported) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const fs::path link = testing::fresh_folder("full") / "a.png";
  fs::create_symlink("/dev/full", link);
  for (const int size : {4, 500}) {  // a full disk is reported on closing, and on writing
    const Status full = write_image(link, noise(size, size));
    ASSERT_FALSE(full);
    EXPECT_EQ(full.error().code, ErrorCode::Unwritable);
    EXPECT_THAT(to_string(full.error()), HasSubstr("No space left"));
  }
}

TEST(ImageFile, RealPhotographsHaveTheirSize) {
  WAYMARK_REAL_DATA(folder, "apriltag-images");
  int photographs = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".jpg") continue;
    ++photographs;
    const Result<ImageInfo> info = probe_image(entry.path());
    ASSERT_TRUE(info) << to_string(info.error());
    EXPECT_EQ(*info, (ImageInfo{ImageFormat::Jpeg, 799, 533, 3, 8}));
    const Result<Image> image = read_image(entry.path());
    ASSERT_TRUE(image) << to_string(image.error());
    EXPECT_EQ(image->width(), 799);
    EXPECT_EQ(image->height(), 533);
  }
  EXPECT_EQ(photographs, 3);
}

}  // namespace
}  // namespace waymark

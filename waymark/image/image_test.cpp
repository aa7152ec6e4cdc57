#include "waymark/image/image.hpp"

#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

Image random_image(int width, int height, std::uint64_t seed) {
  Random random(seed);
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<std::uint8_t>(random.index(256));
  }
  return image;
}

/// An image whose levels at the pixel centres are a + b x + c y. They are integers, so bytes represent them
/// exactly.
Image plane_image(int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<std::uint8_t>(10 + 3 * x + 5 * y);
  }
  return image;
}

TEST(Sampling, ACentreHasThePixelsValue) {
  const Image image = random_image(17, 9, 1);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x)
      EXPECT_EQ(sample_bilinear(image, x + 0.5, y + 0.5), image.row(y)[x]);
  }
}

TEST(Sampling, ReproducesAPlaneBetweenTheOutermostCentres) {
  const Image image = plane_image(20, 12);
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const double x = random.uniform(0.5, 19.5);
    const double y = random.uniform(0.5, 11.5);
    EXPECT_NEAR(sample_bilinear(image, x, y), 10 + 3 * (x - 0.5) + 5 * (y - 0.5), 1e-12);
  }
}

TEST(Sampling, BeyondTheOutermostCentresTheNearestOneIsUsed) {
  const Image image = plane_image(4, 3);
  EXPECT_EQ(sample_bilinear(image, 0.0, 0.0), image.row(0)[0]);
  EXPECT_EQ(sample_bilinear(image, -1e300, 1.5), image.row(1)[0]);
  EXPECT_EQ(sample_bilinear(image, 1e300, 1e300), image.row(2)[3]);
  EXPECT_EQ(sample_bilinear(image, 4.0, 2.0), (image.row(1)[3] + image.row(2)[3]) / 2.0);
  const Image one(1, 1, 77);
  EXPECT_EQ(sample_bilinear(one, -3, 8), 77);
}

TEST(Sampling, IsContinuousAcrossPixelCentres) {
  const Image image = random_image(6, 6, 3);
  for (int i = 1; i < 6; ++i) {
    const double below = sample_bilinear(image, i + 0.5 - 1e-9, 2.2);
    const double above = sample_bilinear(image, i + 0.5 + 1e-9, 2.2);
    EXPECT_NEAR(below, above, 1e-6);
  }
}

TEST(Crop, SharesPixelsAndKeepsTheStride) {
  const Image image = random_image(30, 20, 4);
  const ImageView part = crop(image, 5, 7, 10, 4);
  ASSERT_EQ(part.width, 10);
  ASSERT_EQ(part.height, 4);
  EXPECT_EQ(part.stride, 30);
  EXPECT_EQ(part.data, image.row(7) + 5);
  const ImageView nested = crop(part, 2, 1, 3, 2);
  EXPECT_EQ(nested.at(0, 0), image.row(8)[7]);
}

TEST(Crop, IsClippedToTheImage) {
  const Image image = random_image(8, 6, 5);
  const ImageView corner = crop(image, -3, -2, 5, 4);
  EXPECT_EQ(corner.width, 2);
  EXPECT_EQ(corner.height, 2);
  EXPECT_EQ(corner.data, image.row(0));
  EXPECT_EQ(crop(image, 6, 4, 100, 100).width, 2);
  constexpr int kHuge = std::numeric_limits<int>::max();
  EXPECT_EQ(crop(image, 1, 1, kHuge, kHuge).width, 7);
  EXPECT_EQ(crop(image, -kHuge, 0, kHuge, 6).width, 0);
  EXPECT_TRUE(crop(image, 8, 0, 3, 3).empty());
  EXPECT_TRUE(crop(image, 2, 2, 0, 3).empty());
  EXPECT_TRUE(crop(image, 2, 2, -1, 3).empty());
  EXPECT_TRUE(crop(ImageView{}, 0, 0, 3, 3).empty());
}

TEST(ColorImage, IsPackedRedGreenBlue) {
  ColorImage image(3, 2, {1, 2, 3});
  image.row(1)[2] = {10, 20, 30};
  EXPECT_EQ(image.at(2, 1), (Rgb{10, 20, 30}));
  EXPECT_EQ(image.row_bytes(1)[6], 10);
  EXPECT_EQ(image.row_bytes(1)[8], 30);
  EXPECT_EQ(image.row_bytes(0)[4], 2);
}

TEST(ColorImage, FromGreyHasThreeEqualChannels) {
  const Image image = random_image(7, 5, 6);
  const ColorImage color = to_color(crop(image, 1, 1, 4, 3));
  ASSERT_EQ(color.width(), 4);
  ASSERT_EQ(color.height(), 3);
  const std::uint8_t grey = image.row(3)[4];
  EXPECT_EQ(color.at(3, 2), (Rgb{grey, grey, grey}));
}

}  // namespace
}  // namespace waymark

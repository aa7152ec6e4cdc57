#include "waymark/plot/annotate.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace waymark::plot {
namespace {

TagDetection square(double x, double y, double side) {
  return {.tag = {FamilyId::Tag36h11, 7},
          .corners_px = {Eigen::Vector2d(x, y), {x + side, y}, {x + side, y + side}, {x, y + side}}};
}

Image gray_ramp(int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<std::uint8_t>((x + 3 * y) % 256);
  }
  return image;
}

bool is_red(Rgb c) { return c.r > 180 && c.g < 110 && c.b < 110; }
bool is_green(Rgb c) { return c.g > 130 && c.r < 110 && c.b < 140; }
bool is_yellow(Rgb c) { return c.r > 180 && c.g > 150 && c.b < 130; }

TEST(Annotate, WithoutTagsTheImageIsUnchanged) {
  const Image image = gray_ramp(257, 31);
  const auto drawn = annotate(image, {});
  ASSERT_TRUE(drawn);
  EXPECT_EQ(*drawn, to_color(image));
  EXPECT_TRUE(annotate(ImageView{}, {})->empty());
}

TEST(Annotate, ReadsAViewWithStride) {
  const Image image = gray_ramp(100, 20);
  const auto drawn = annotate(ImageView{image.row(5) + 10, 30, 10, 100}, {});
  ASSERT_TRUE(drawn);
  EXPECT_EQ(drawn->at(3, 2).g, image.row(7)[13]);
}

TEST(Annotate, SidesShowTheAxesAtTheCorners) {
  const Image image(400, 400, 128);
  const auto drawn = annotate(image, std::vector{square(120, 120, 160)});  // lines are 4 px wide
  ASSERT_TRUE(drawn);
  EXPECT_TRUE(is_red(drawn->at(200, 120)));
  EXPECT_TRUE(is_red(drawn->at(200, 119)));
  EXPECT_TRUE(is_green(drawn->at(120, 200)));
  EXPECT_TRUE(is_yellow(drawn->at(280, 200)));
  EXPECT_TRUE(is_yellow(drawn->at(200, 280)));
  EXPECT_TRUE(is_yellow(drawn->at(200, 200)));           // centre
  EXPECT_TRUE(is_red(drawn->at(115, 117)));              // dot at TL
  EXPECT_EQ(drawn->at(150, 250), (Rgb{128, 128, 128}));  // pixels next to the drawing are unchanged
}

TEST(Annotate, TheLabelStaysInTheImage) {
  const Image image(300, 100, 255);
  for (const double x : {2.0, 250.0}) {
    for (const double y : {2.0, 50.0}) {  // at the top edge, only the space below is free
      const auto drawn = annotate(image, std::vector{square(x, y, 45)});
      ASSERT_TRUE(drawn);
      int letters = 0;
      for (int row = 0; row < 100; ++row) {
        const bool beside_quad = row < y - 5 || row > y + 50;
        for (int column = 0; beside_quad && column < 300; ++column) {
          const Rgb c = drawn->at(column, row);
          letters += c.r > c.b + 60 ? 1 : 0;
        }
      }
      EXPECT_GT(letters, 80) << x << " " << y;
    }
  }
}

TEST(Annotate, IsDeterministic) {
  const Image image = gray_ramp(200, 200);
  const std::vector<TagDetection> tags = {square(20.3, 40.7, 61.1), square(90, 90, 12)};
  EXPECT_EQ(*annotate(image, tags), *annotate(image, tags));
}

TEST(Annotate, ExtremeCornersAreHarmless) {
  const Image image = gray_ramp(50, 50);
  const double huge = 1e300;
  TagDetection tag = square(-huge, 10, huge);
  EXPECT_TRUE(annotate(image, std::vector{tag}));
  tag.corners_px[2].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(*annotate(image, std::vector{tag}), to_color(image));
}

TEST(Annotate, AnImageTooLargeForCairoIsAnError) {
  const Image image(32768, 1);
  const auto drawn = annotate(image, {});
  ASSERT_FALSE(drawn);
  EXPECT_EQ(drawn.error().code, ErrorCode::LimitExceeded);
}

}  // namespace
}  // namespace waymark::plot

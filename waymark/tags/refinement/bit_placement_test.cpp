// Tests corners that are estimated from the bits inside, for tags with an unreliable border.
#include "waymark/tags/refinement/bit_placement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "tests/support/facing_tag.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark {
namespace {

using testing::corners_of;
using testing::detection_at;
using testing::Print;
using testing::render;
using testing::worst_error;

Print print_of(FamilyId id, double roll_rad) {
  Print print;
  print.tag = {id, 3};
  print.roll_rad = roll_rad;
  print.side_px = 6.5 * family(id).width_at_border;
  print.black = 20;
  print.noise = 3;
  return print;
}

/// An image in which white paper covers a fifth of a cell along the first edge.
Image covered(const Print& print) {
  const auto corners = corners_of(print);
  const Eigen::Vector2d inwards = (corners[3] - corners[0]).normalized();
  Image image = render(print);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double depth_px = inwards.dot(Eigen::Vector2d(x + 0.5, y + 0.5) - corners[0]);
      const double over = std::clamp(0.5 + (0.2 * 6.5 - depth_px) / 1.5, 0.0, 1.0);
      std::uint8_t& pixel = image.row(y)[x];
      pixel = static_cast<std::uint8_t>(std::lround(pixel + over * (print.white - pixel)));
    }
  }
  return image;
}

/// If the border is partly covered, an edge moves by more than a pixel.
TEST(BitPlacement, FindsACoveredEdgeFromTheBits) {
  Random random(6);
  double nees = 0;
  int count = 0;
  for (const FamilyId id : {FamilyId::Tag36h11, FamilyId::Tag36h10, FamilyId::Tag25h9}) {
    for (const double roll_rad : {0.0, 0.5, 2.0, 4.0}) {
      const Print print = print_of(id, roll_rad);
      const auto result = refine_corners(covered(print), detection_at(print, 0.3, random));
      ASSERT_TRUE(result.refined()) << to_string(id) << " " << roll_rad << " " << to_string(result.outcome);
      EXPECT_TRUE(result.by_bits) << to_string(id) << " " << roll_rad;
      EXPECT_LT(worst_error(result.corners_px, print), 0.2) << to_string(id) << " " << roll_rad;
      nees += testing::nees(result.corners_px, result.covariance_px2, print) / 8;
      ++count;
    }
  }
  EXPECT_LT(nees / count, 2);
  EXPECT_GT(nees / count, 0.3);
}

TEST(BitPlacement, KeepsCornersIfTheBorderAgrees) {
  Random random(7);
  for (const double roll_rad : {0.0, 0.5, 2.0}) {
    const Print print = print_of(FamilyId::Tag36h11, roll_rad);
    const auto result = refine_corners(render(print), detection_at(print, 0.3, random));
    ASSERT_TRUE(result.refined());
    EXPECT_FALSE(result.by_bits);
  }
}

/// The result agrees with the corners estimated from an intact border. For families with few bits inside
/// there may be no result.
TEST(BitPlacement, AgreesWithAnIntactBorder) {
  Random random(8);
  for (const FamilyId id : kAllFamilies) {
    const Print print = print_of(id, 0.7);
    const auto placed =
        refinement::place_by_bits(render(print), detection_at(print, 0.3, random), {print.tag}, {}, nullptr);
    const bool few = family(id).width_at_border < 6;
    EXPECT_FALSE(placed && few) << to_string(id);
    EXPECT_TRUE(placed || few || family(id).reversed_border) << to_string(id);
    if (placed)
      EXPECT_LT(testing::nees(placed->corners_px, placed->covariance_px2, print), 24)
          << to_string(id);  // the expected value is 8
  }
}

TEST(BitPlacement, HasNoResultWithoutBits) {
  Random random(9);
  const Print print = print_of(FamilyId::Tag36h11, 0.3);
  const TagDetection detection = detection_at(print, 0.3, random);
  Image blank(render(print).width(), render(print).height(), 120);
  EXPECT_FALSE(refinement::place_by_bits(blank, detection, {detection.tag}, {}, nullptr));
  TagDetection other = detection;  // a tag whose bits differ from the print
  other.tag.number = 4;
  EXPECT_FALSE(refinement::place_by_bits(render(print), other, {other.tag}, {}, nullptr));
  for (int y = 0; y < blank.height(); ++y)
    for (int x = 0; x < blank.width(); ++x) blank.row(y)[x] = static_cast<std::uint8_t>(random.index(256));
  EXPECT_FALSE(refinement::place_by_bits(blank, detection, {detection.tag}, {}, nullptr));
}

}  // namespace
}  // namespace waymark

#include "waymark/tags/detector/bit_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "waymark/base/random.hpp"

namespace waymark::search {
namespace {

using testing::add_noise;
using testing::max_corner_error_px;
using testing::paint_tag;
using testing::square_corners;
using testing::TagCorners;

Quad quad_of(const TagCorners& corners) {
  Quad quad;
  for (std::size_t i = 0; i < 4; ++i) quad[i] = corners.at(i).cast<float>();
  return quad;
}

TagCorners corners_of(const Quad& quad) {
  TagCorners corners;
  for (std::size_t i = 0; i < 4; ++i) corners.at(i) = quad[i].cast<double>();
  return corners;
}

/// A tag with a side of 64 px (8 px per cell in tag36h11), seen obliquely.
struct Scene {
  ReadableFamily family;
  TagId tag;
  TagCorners truth;
  Image image{200, 200, 140};

  Scene(FamilyId id, int number, Random& random) : family(waymark::family(id), 0), tag{id, number} {
    truth = square_corners({100, 100}, 64, random.uniform(0, 6));
    for (Eigen::Vector2d& corner : truth)
      corner += 4 * Eigen::Vector2d(random.uniform(-1, 1), random.uniform(-1, 1));
    paint_tag(image, tag, truth);
    add_noise(image, 3, random);
  }
};

class BitGridOf : public ::testing::TestWithParam<FamilyId> {};
INSTANTIATE_TEST_SUITE_P(Families, BitGridOf,
                         ::testing::Values(FamilyId::Tag36h11, FamilyId::Tag25h9, FamilyId::TagStandard41h12,
                                           FamilyId::TagCircle49h12),
                         [](const auto& of) { return std::string(to_string(of.param)); });

TEST_P(BitGridOf, CorrectCornersAreUnchanged) {
  Random random(3);
  BitGrid grid;
  for (int round = 0; round < 20; ++round) {
    const Scene scene(GetParam(), round, random);
    TagDetection tag{.tag = scene.tag, .corners_px = scene.truth};
    ASSERT_TRUE(grid.align_corners(scene.image, scene.family, false, tag)) << round;
    EXPECT_EQ(tag.corners_px, scene.truth) << round;
  }
}

TEST_P(BitGridOf, ASideThatContradictsTheBitsIsCorrected) {
  Random random(5);
  BitGrid grid;
  for (int round = 0; round < 20; ++round) {
    const Scene scene(GetParam(), round, random);
    const auto side = static_cast<std::size_t>(round % 4);
    const float off = round % 2 == 0 ? 0.5F : -0.5F;
    TagDetection tag{
        .tag = scene.tag,
        .corners_px = corners_of(with_side_moved(quad_of(scene.truth), side, off, scene.family.width))};
    ASSERT_GT(max_corner_error_px(tag.corners_px, scene.truth), 3);
    ASSERT_TRUE(grid.align_corners(scene.image, scene.family, false, tag)) << round;
    EXPECT_LT(max_corner_error_px(tag.corners_px, scene.truth), 0.75) << round << ", side " << side;
  }
}

// The hole of tagCustom48h12 is two cells wide. MBot's tags contain a smaller tag there.
TEST(BitGrid, ATagInTheHoleOfATagMovesNoCorner) {
  Random random(7);
  BitGrid grid;
  for (int round = 0; round < 12; ++round) {
    Scene scene(FamilyId::TagCustom48h12, round, random);
    const Eigen::Vector2d middle = 0.25 * (scene.truth[0] + scene.truth[1] + scene.truth[2] + scene.truth[3]);
    TagCorners inner = scene.truth;
    for (Eigen::Vector2d& corner : inner) corner = middle + 0.2 * (corner - middle);
    paint_tag(scene.image, {FamilyId::TagCustom48h12, round + 20}, inner);
    TagDetection tag{.tag = scene.tag, .corners_px = scene.truth};
    ASSERT_TRUE(grid.align_corners(scene.image, scene.family, false, tag)) << round;
    EXPECT_EQ(tag.corners_px, scene.truth) << round;
  }
}

/// Distance between the true corners and those found after correcting a misplaced side.
double error_put_back_px(const Scene& scene, const MisplacedSide& found) {
  const Quad back = with_side_moved(found.quad, found.side, found.missing, scene.family.width);
  return max_corner_error_px(corners_of(back), scene.truth);
}

/// Whether a side is among those found and has been corrected accurately.
bool found_near(const Scene& scene, const MisplacedSides& found, std::size_t side, double within_px) {
  return std::any_of(
      found.sides.begin(), found.sides.begin() + static_cast<std::ptrdiff_t>(found.count),
      [&](const MisplacedSide& at) { return at.side == side && error_put_back_px(scene, at) < within_px; });
}

TEST(BitGrid, FindsAMisplacedSideAndItsCorrection) {
  Random random(11);
  BitGrid grid;
  int missed = 0;
  for (int round = 0; round < 60; ++round) {
    const Scene scene(FamilyId::Tag36h11, round, random);
    EXPECT_EQ(grid.misplaced_sides(scene.image, quad_of(scene.truth), scene.family, false).count, 0U)
        << round;
    const auto side = static_cast<std::size_t>(round % 4);
    // A whole cell may be missing at either end.
    const float missing = std::array<float, 3>{-0.4F, 1.0F, 1.3F}.at(static_cast<std::size_t>(round % 3));
    const Quad seen = with_side_moved(quad_of(scene.truth), side, -missing, scene.family.width);
    const auto found = grid.misplaced_sides(scene.image, seen, scene.family, false);
    missed += found_near(scene, found, side, 5.5) ? 0 : 1;
  }
  EXPECT_LE(missed, 2);
}

TEST(BitGrid, ASlantedSideIsFirstMadeParallel) {
  Random random(13);
  BitGrid grid;
  int missed = 0;
  for (int round = 0; round < 40; ++round) {
    const Scene scene(FamilyId::Tag36h11, round, random);
    const auto side = static_cast<std::size_t>(round % 4);
    Quad seen = quad_of(scene.truth);
    seen[side] = with_side_moved(seen, side, -0.7F, scene.family.width)[side];
    const std::size_t next = (side + 1) % 4;
    seen[next] = with_side_moved(quad_of(scene.truth), side, -1.9F, scene.family.width)[next];
    const auto found = grid.misplaced_sides(scene.image, seen, scene.family, false);
    missed += found_near(scene, found, side, 8) ? 0 : 1;
  }
  EXPECT_LE(missed, 2);
}

}  // namespace
}  // namespace waymark::search

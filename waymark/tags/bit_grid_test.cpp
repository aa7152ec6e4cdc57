#include "waymark/tags/bit_grid.hpp"

#include <cmath>
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

/// A tag of 64 px (8 px a cell in tag36h11), seen aslant.
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
                         [](const auto& info) { return std::string(to_string(info.param)); });

TEST_P(BitGridOf, CornersThatAreRightStayAsTheyAre) {
  Random random(3);
  BitGrid grid;
  for (int round = 0; round < 20; ++round) {
    const Scene scene(GetParam(), round, random);
    TagDetection tag{.tag = scene.tag, .corners_px = scene.truth};
    ASSERT_TRUE(grid.settle(scene.image, scene.family, false, tag)) << round;
    EXPECT_EQ(tag.corners_px, scene.truth) << round;
  }
}

TEST_P(BitGridOf, ASideOfTheQuadThatTheBitsContradictIsMovedToWhereTheySayItIs) {
  Random random(5);
  BitGrid grid;
  for (int round = 0; round < 20; ++round) {
    const Scene scene(GetParam(), round, random);
    const auto side = static_cast<std::size_t>(round % 4);
    const float off = round % 2 == 0 ? 0.5F : -0.5F;
    TagDetection tag{
        .tag = scene.tag,
        .corners_px = corners_of(with_side_moved(quad_of(scene.truth), {side, off}, scene.family.width))};
    ASSERT_GT(max_corner_error_px(tag.corners_px, scene.truth), 3);
    ASSERT_TRUE(grid.settle(scene.image, scene.family, false, tag)) << round;
    EXPECT_LT(max_corner_error_px(tag.corners_px, scene.truth), 0.75) << round << ", side " << side;
  }
}

TEST(BitGrid, FindsTheSideThatIsMisplacedAndWhereItShouldBe) {
  Random random(11);
  BitGrid grid;
  int missed = 0;
  for (int round = 0; round < 40; ++round) {
    const Scene scene(FamilyId::Tag36h11, round, random);
    EXPECT_FALSE(grid.misplaced_side(scene.image, quad_of(scene.truth), scene.family, false)) << round;
    const auto side = static_cast<std::size_t>(round % 4);
    const float missing = round % 3 == 0 ? -0.4F : 1.0F;
    const Quad seen = with_side_moved(quad_of(scene.truth), {side, -missing}, scene.family.width);
    const auto found = grid.misplaced_side(scene.image, seen, scene.family, false);
    if (!found) {
      ++missed;
      continue;
    }
    EXPECT_EQ(found->side, side) << round;
    const Quad back = with_side_moved(seen, *found, scene.family.width);
    EXPECT_LT(max_corner_error_px(corners_of(back), scene.truth), 3.5) << round;
  }
  EXPECT_LE(missed, 1);
}

}  // namespace
}  // namespace waymark::search

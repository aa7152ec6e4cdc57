#include "waymark/tags/refinement/curved_border.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "tests/support/bent_tags.hpp"
#include "tests/support/draw_tag.hpp"
#include "waymark/base/random.hpp"

namespace waymark::refinement {
namespace {

using testing::add_noise;
using testing::Bend;
using testing::bent_tag;
using testing::BentTag;
using testing::max_corner_error_px;
using testing::paint_tag;
using testing::square_corners;

Quad shaken(const Quad& corners, double by_px, Random& random) {
  Quad near = corners;
  for (Eigen::Vector2d& corner : near) {
    corner.x() += random.uniform(-by_px, by_px);
    corner.y() += random.uniform(-by_px, by_px);
  }
  return near;
}

double largest_bulge_px(const CurvedBorder& border) {
  double largest = 0;
  for (const Eigen::Vector3d& bulge : border.bulge_px) largest = std::max(largest, std::abs(bulge[0]));
  return largest;
}

TEST(CurvedBorder, IsStraightOnAFlatTag) {
  Random random(3);
  for (int round = 0; round < 12; ++round) {
    const TagId tag{FamilyId::Tag36h11, round};
    Image image(160, 160, 140);
    const Quad truth = square_corners({80, 80}, random.uniform(40, 90), random.uniform(0, 6));
    paint_tag(image, tag, truth);
    add_noise(image, 2, random);
    const auto border = follow_border(image, {tag}, shaken(truth, 1.5, random));
    ASSERT_TRUE(border) << round;
    EXPECT_LT(max_corner_error_px(border->corners_px, truth), 0.4) << round;
    EXPECT_LT(largest_bulge_px(*border), 0.25) << round;
    EXPECT_NEAR(border->contrast, 190, 20) << round;
  }
}

TEST(CurvedBorder, IsFollowedOnABottle) {
  Random random(5);
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const BentTag bent = bent_tag({Bend::Cylinder, 60, 90}, seed);
    const auto border = follow_border(bent.image, {bent.truth.tag}, shaken(bent.truth.corners_px, 2, random));
    ASSERT_TRUE(border) << seed;
    EXPECT_LT(max_corner_error_px(border->corners_px, bent.truth.corners_px), 0.6) << seed;
    const double least_variance = border->covariance_px2.diagonal().minCoeff();
    EXPECT_GT(least_variance, 0) << seed;
  }
}

TEST(CurvedBorder, IsNotFollowedWhereASideIsMissing) {
  const TagId tag{FamilyId::Tag36h11, 1};
  Image image(160, 160, 140);
  const Quad truth = square_corners({80, 80}, 80, 0.2);
  paint_tag(image, tag, truth);
  for (int y = 0; y < 160; ++y)
    for (int x = 0; x < 60; ++x) image.row(y)[x] = 30;
  EXPECT_FALSE(follow_border(image, {tag}, truth));
}

}  // namespace
}  // namespace waymark::refinement

#include "waymark/pose/square_pose.hpp"

#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/tag_views.hpp"

namespace waymark {
namespace {

using Bearings = std::array<Eigen::Vector3d, 4>;

Bearings bearings_to(const SE3& cam_T_tag, double size_m = testing::kTagSize) {
  Bearings bearings;
  for (std::size_t i = 0; i < 4; ++i)
    bearings[i] = (cam_T_tag * testing::tag_corners(size_m)[i]).normalized();
  return bearings;
}

TEST(SquarePose, OneSolutionIsExactWithoutNoise) {
  Random random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    const SE3 cam_T_tag =
        testing::random_view(random, {.min_size_px = 5, .max_size_px = 400, .max_tilt_deg = 80});
    const SquarePoses poses = square_poses(bearings_to(cam_T_tag), testing::kTagSize);
    ASSERT_EQ(poses.defect, QuadDefect::None);
    // Perspective distinguishes the two poses, if only slightly, so without noise the correct one comes
    // first. For a frontal tag they coincide, and the error of their rotation is the square root of the
    // rounding error.
    EXPECT_THAT(poses.cam_T_tag[0], testing::SE3Near(cam_T_tag, 1e-9, 1e-6));
  }
}

TEST(SquarePose, WorksInEveryDirection) {
  Random random(2);
  for (int trial = 0; trial < 500; ++trial) {
    const SO3 turn =
        SO3::exp(3.0 * Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
    const SE3 cam_T_tag =
        SE3(turn, Eigen::Vector3d::Zero()) * testing::random_view(random, {.min_tilt_deg = 5});
    const SquarePoses poses = square_poses(bearings_to(cam_T_tag), testing::kTagSize);
    ASSERT_EQ(poses.defect, QuadDefect::None);
    EXPECT_THAT(poses.cam_T_tag[0], testing::SE3Near(cam_T_tag, 1e-9, 1e-7));
  }
}

// Both solutions have the same image of the centre and the same first derivatives (Collins and Bartoli,
// section 4): tags scaled down to a thousandth about their centres have the same image.
TEST(SquarePose, BothSolutionsAgreeToFirstOrder) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const SE3 cam_T_tag = testing::random_view(random, {.min_tilt_deg = 10});
    const SquarePoses poses = square_poses(bearings_to(cam_T_tag), testing::kTagSize);
    const Bearings first = bearings_to(poses.cam_T_tag[0], 1e-3 * testing::kTagSize);
    const Bearings second = bearings_to(poses.cam_T_tag[1], 1e-3 * testing::kTagSize);
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_LT((first[i] - second[i]).norm(), 1e-6 * (first[0] - first[2]).norm() * 1e3);
    // They are tilted by the same angle to opposite sides of the line of sight.
    const Eigen::Vector3d sight = cam_T_tag.translation().normalized();
    const Eigen::Vector3d z0 = poses.cam_T_tag[0].rotation() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d z1 = poses.cam_T_tag[1].rotation() * Eigen::Vector3d::UnitZ();
    EXPECT_NEAR(z0.dot(sight), z1.dot(sight), 1e-9);
    EXPECT_LT((z0 + z1).normalized().cross(sight).norm(), 1e-9);
    EXPECT_GT(z0.dot(sight), 0) << "seen from the front";
  }
}

TEST(SquarePose, ScalesWithTheSize) {
  Random random(4);
  const SE3 cam_T_tag = testing::random_view(random);
  const Bearings bearings = bearings_to(cam_T_tag);
  const SquarePoses one = square_poses(bearings, 1);
  for (const double size : {1e-6, 0.05, 3.0, 1e6}) {
    const SquarePoses scaled = square_poses(bearings, size);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LT((scaled.cam_T_tag[i].translation() - size * one.cam_T_tag[i].translation()).norm(),
                1e-12 * size * 100);
      EXPECT_THAT(scaled.cam_T_tag[i].rotation(), testing::SO3Near(one.cam_T_tag[i].rotation(), 1e-12));
    }
  }
}

Bearings bearings_through(const std::array<Eigen::Vector2d, 4>& image) {
  Bearings bearings;
  for (std::size_t i = 0; i < 4; ++i) bearings[i] = image[i].homogeneous().normalized();
  return bearings;
}

TEST(SquarePose, ReportsTheDefectOfAQuad) {
  struct Case {
    std::array<Eigen::Vector2d, 4> image;
    QuadDefect defect;
  };
  const Case cases[] = {
      {{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}}, QuadDefect::None},
      {{{{0, 0}, {0, 1}, {1, 1}, {1, 0}}}, QuadDefect::Mirrored},
      {{{{0, 0}, {1, 1}, {1, 0}, {0, 1}}}, QuadDefect::NotConvex},
      {{{{0, 0}, {1, 0}, {0.3, 0.3}, {0, 1}}}, QuadDefect::NotConvex},
      {{{{0, 0}, {1, 0}, {2, 0}, {0, 1}}}, QuadDefect::Collinear},
      {{{{0, 0}, {1, 0}, {2, 0}, {3, 0}}}, QuadDefect::Collinear},
      {{{{0, 0}, {1, 0}, {1, 0}, {0, 1}}}, QuadDefect::RepeatedCorner},
      {{{{0, 0}, {1, 0}, {0, 0}, {0, 1}}}, QuadDefect::RepeatedCorner},
      {{{{0.5, 0.5}, {0.5, 0.5}, {0.5, 0.5}, {0.5, 0.5}}}, QuadDefect::RepeatedCorner},
      {{{{0, 0}, {1e-9, 0}, {1e-9, 1e-9}, {0, 1e-9}}}, QuadDefect::RepeatedCorner},
  };
  for (const Case& c : cases) {
    EXPECT_EQ(square_poses(bearings_through(c.image), 1).defect, c.defect) << to_string(c.defect);
  }
}

// The result depends only on the order of the corners: rotating the list does not change it, and reversing
// the list mirrors the quad.
TEST(SquarePose, TheDefectIsInvariantToRotationOfTheCorners) {
  Random random(5);
  int convex = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    Bearings bearings;
    for (auto& b : bearings)
      b = Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), 1).normalized();
    const QuadDefect verdict = square_poses(bearings, 1).defect;
    std::rotate(bearings.begin(), bearings.begin() + 1, bearings.end());
    EXPECT_EQ(square_poses(bearings, 1).defect, verdict);
    std::reverse(bearings.begin(), bearings.end());
    const QuadDefect reversed = square_poses(bearings, 1).defect;
    if (verdict == QuadDefect::None) {
      ++convex;
      EXPECT_EQ(reversed, QuadDefect::Mirrored);
    } else {
      EXPECT_NE(reversed, QuadDefect::RepeatedCorner);
    }
  }
  EXPECT_GT(convex, 100);
}

}  // namespace
}  // namespace waymark

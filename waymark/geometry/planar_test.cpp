#include "waymark/geometry/planar.hpp"

#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/geometry_samples.hpp"

namespace waymark {
namespace {

using testing::random_element;
using testing::SE2Near;
using testing::SE3Near;

TEST(Planar, AxesAndAngles) {
  const SE2 map_T_base(1, 2, std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(map_T_base.x(), 1);
  EXPECT_DOUBLE_EQ(map_T_base.y(), 2);
  EXPECT_DOUBLE_EQ(map_T_base.yaw(), std::numbers::pi / 2);
  EXPECT_THAT(map_T_base * Eigen::Vector2d(1, 0), testing::MatrixNear(Eigen::Vector2d(1, 3), 1e-15));
  EXPECT_DOUBLE_EQ(SO2(std::numbers::pi).angle(), std::numbers::pi);
  EXPECT_DOUBLE_EQ(SO2(3 * std::numbers::pi / 2).angle(), -std::numbers::pi / 2);
  // -pi and +pi are the same heading and are represented by the same value.
  EXPECT_GT((SO2(std::numbers::pi / 2) * SO2(std::numbers::pi / 2)).angle(), 3);
  EXPECT_GT(SO2::from_cos_sin(-1.0, -0.0).angle(), 3);
}

TEST(Planar, LiftIsAHomomorphism) {
  Random random(41);
  for (int i = 0; i < 50; ++i) {
    const SE2 X = random_element<SE2>(random), Y = random_element<SE2>(random);
    EXPECT_THAT(lift(X * Y), SE3Near(lift(X) * lift(Y), 1e-14, 1e-14));
    EXPECT_THAT(lift(X.inverse()), SE3Near(lift(X).inverse(), 1e-14, 1e-14));
    const SE2::Tangent xi = testing::random_tangent<SE2>(random, random.uniform(0, 3), 2.0);
    const SE3::Tangent lifted = (SE3::Tangent() << xi[0], xi[1], 0, 0, 0, xi[2]).finished();
    EXPECT_THAT(lift(SE2::exp(xi)), SE3Near(SE3::exp(lifted), 1e-14, 1e-14));
  }
}

TEST(Planar, ProjectionUndoesLiftAndCommutesWithPlanarMotion) {
  Random random(42);
  for (int i = 0; i < 50; ++i) {
    const SE2 A = random_element<SE2>(random);
    const SE3 X = random_element<SE3>(random);
    EXPECT_THAT(project_to_plane(lift(A)), SE2Near(A, 1e-14, 1e-14));
    EXPECT_THAT(project_to_plane(lift(A) * X), SE2Near(A * project_to_plane(X), 1e-14, 1e-12));
  }
}

TEST(Planar, ProjectionTakesTheHeadingOfTheForwardAxis) {
  const SE3 climbing(SO3::from_rpy(0.2, -0.4, 0.7), {1, 2, 3});
  EXPECT_THAT(project_to_plane(climbing), SE2Near(SE2(1, 2, 0.7), 1e-15, 1e-15));
  const Eigen::Matrix3d nose_up = (Eigen::Matrix3d() << 0, 0, -1, 0, 1, 0, 1, 0, 0).finished();
  EXPECT_TRUE(std::isfinite(project_to_plane(SE3(SO3::from_matrix(nose_up), {1, 2, 3})).yaw()));
}

TEST(Planar, TheEquationsOfAPoseChain) {  // docs/concepts/geometry.md, equations (1) to (5)
  Random random(43);
  const SE3 map_T_tag = random_element<SE3>(random), map_T_cam = random_element<SE3>(random);
  const SE3 cam_T_tag = map_T_cam.inverse() * map_T_tag;
  EXPECT_THAT(map_T_tag * cam_T_tag.inverse(), SE3Near(map_T_cam, 1e-14, 1e-14));
  const Eigen::Vector3d tag_p(0.1, -0.2, 0.3);
  EXPECT_THAT(cam_T_tag * tag_p,
              testing::MatrixNear(Eigen::Vector3d(map_T_cam.inverse() * (map_T_tag * tag_p)), 1e-14));
}

}  // namespace
}  // namespace waymark

// Tests the displacement of the print on a tag due to lens distortion.
#include "waymark/tags/refinement/lens_bends.hpp"

#include <algorithm>
#include <array>

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "waymark/base/random.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark::refinement {
namespace {

CameraModel wide() {
  PinholeRadtan lens{.fx = 900, .fy = 900, .cx = 640, .cy = 360};
  lens.k[0] = -0.25;
  lens.coefficients = 4;
  return CameraModel::make(lens, 1280, 720).value();
}

/// A tilted square with a side of 60 px near the border of the image.
struct Square {
  CameraModel camera = wide();
  SE3 cam_T_tag = SE3(SO3::exp({0.7, -0.4, 0.3}), Eigen::Vector3d(1.3, 0.5, 2.3));
  [[nodiscard]] Eigen::Vector2d px(double s, double t) const {
    return camera.project(cam_T_tag * Eigen::Vector3d(0.075 * s, 0.075 * t, 0)).value();
  }
  [[nodiscard]] Quad corners() const { return {px(-1, -1), px(1, -1), px(1, 1), px(-1, 1)}; }
};

TEST(LensField, MatchesTheDistortedPrint) {
  const Square square;
  const auto field = lens_field(square.camera, edge_frames(square.corners(), 8));
  ASSERT_TRUE(field);
  const Eigen::Matrix3d px_H_unit = homography_of_unit_square(square.corners());
  Random random(3);
  double largest = 0;
  for (int i = 0; i < 100; ++i) {
    const double s = random.uniform(-1, 1);
    const double t = random.uniform(-1, 1);
    const Eigen::Vector2d flat = (px_H_unit * Eigen::Vector3d((s + 1) / 2, (t + 1) / 2, 1)).hnormalized();
    const Eigen::Vector2d off = square.px(s, t) - flat;
    largest = std::max(largest, off.norm());
    EXPECT_LT((field->at(s, t) - off).norm(), 0.005) << s << " " << t;
  }
  EXPECT_GT(largest, 0.1) << "otherwise the test proves nothing";
  for (const double s : {-1.0, 1.0})
    for (const double t : {-1.0, 1.0}) EXPECT_LT(field->at(s, t).norm(), 1e-9);
}

/// The intersections of the least squares lines through the middle part of each curved edge.
Quad fitted_with_straight_sides(const CameraModel& camera, const SE3& cam_T_tag, double half_m) {
  constexpr double kReach = 0.76;
  constexpr int kPoints = 101;
  const std::array<Eigen::Vector2d, 4> corner = {Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, -1),
                                                 Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, 1)};
  std::array<Eigen::Hyperplane<double, 2>, 4> side;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d middle = 0.5 * (corner[k] + corner[(k + 1) % 4]);
    const Eigen::Vector2d half = 0.5 * (corner[(k + 1) % 4] - corner[k]);
    Eigen::Matrix<double, 2, kPoints> px;
    for (int i = 0; i < kPoints; ++i) {
      const Eigen::Vector2d at = middle + kReach * (2.0 * i / (kPoints - 1) - 1) * half;
      px.col(i) = camera.project(cam_T_tag * Eigen::Vector3d(half_m * at.x(), half_m * at.y(), 0)).value();
    }
    const Eigen::Vector2d mean = px.rowwise().mean();
    const Eigen::Matrix2d spread = (px.colwise() - mean) * (px.colwise() - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
    side[k] = Eigen::Hyperplane<double, 2>(Eigen::Vector2d(axes.eigenvectors().col(0)), mean);
  }
  Quad quad;
  for (std::size_t k = 0; k < 4; ++k) quad[k] = side[(k + 3) % 4].intersection(side[k]);
  return quad;
}

// Up to 56 degrees off the axis of a fisheye, where straight sides misplace the corners by 6 px.
TEST(CornersOfCurvedEdges, AreComputedFromStraightSides) {
  const CameraModel fisheye =
      CameraModel::make(Equidistant{.fx = 444, .fy = 444, .cx = 640, .cy = 480, .k = {0.01, -0.003, 0, 0}},
                        1280, 960)
          .value();
  for (const double off_axis : {0.0, 0.45, 0.68, 0.84, 0.98}) {
    const SO3 turn = SO3::exp({0, off_axis, 0});
    const SE3 cam_T_tag(turn * SO3::exp({0.3, 0.0, 0.1}), turn * Eigen::Vector3d(0, 0, 0.42));
    constexpr double kHalf_m = 0.08;
    const Quad fitted = fitted_with_straight_sides(fisheye, cam_T_tag, kHalf_m);
    const Quad corners = corners_of_curved_edges(fisheye, fitted, 8);
    const std::array<Eigen::Vector3d, 4> truth = {
        Eigen::Vector3d(-kHalf_m, -kHalf_m, 0), Eigen::Vector3d(kHalf_m, -kHalf_m, 0),
        Eigen::Vector3d(kHalf_m, kHalf_m, 0), Eigen::Vector3d(-kHalf_m, kHalf_m, 0)};
    double before = 0;
    double after = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d px = fisheye.project(cam_T_tag * truth[k]).value();
      before = std::max(before, (fitted[k] - px).norm());
      after = std::max(after, (corners[k] - px).norm());
    }
    EXPECT_GT(before, 0.9) << off_axis;
    EXPECT_LT(after, 0.1 * before) << off_axis;
  }
}

TEST(LensField, IsZeroWithoutDistortionAndUndefinedOutsideTheDomain) {
  const Square square;
  const CameraModel plain =
      CameraModel::make(PinholeRadtan{.fx = 900, .fy = 900, .cx = 640, .cy = 360}, 1280, 720).value();
  const auto none = lens_field(plain, edge_frames(square.corners(), 8));
  ASSERT_TRUE(none);
  for (const Eigen::Vector2d& off : none->off_px) EXPECT_LT(off.norm(), 1e-9);
  Quad beyond = square.corners();
  for (Eigen::Vector2d& corner : beyond) corner += Eigen::Vector2d(3000, 0);
  EXPECT_FALSE(lens_field(square.camera, edge_frames(beyond, 8)));
}

}  // namespace
}  // namespace waymark::refinement

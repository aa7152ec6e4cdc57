// Tests the displacement of the print on a tag due to lens distortion.
#include "waymark/tags/refinement/lens_bends.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include <gtest/gtest.h>
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

/// The bulges of the edges are those at their middles in the image.
TEST(RadialField, FollowsTheDistortedPrintFromTheBulgesOfItsEdges) {
  const Square square;
  const auto edges = edge_frames(square.corners(), 8);
  const auto lens = lens_field(square.camera, edges);
  ASSERT_TRUE(lens);
  const Eigen::Matrix3d px_H_unit = homography_of_unit_square(square.corners());
  const auto flat_px = [&](double s, double t) -> Eigen::Vector2d {
    return (px_H_unit * Eigen::Vector3d((s + 1) / 2, (t + 1) / 2, 1)).hnormalized();
  };
  const std::array<Eigen::Vector2d, 4> middle_st = {Eigen::Vector2d(0, -1), {1, 0}, {0, 1}, {-1, 0}};
  std::array<double, 4> bend_px{};
  for (std::size_t k = 0; k < 4; ++k)
    bend_px.at(k) = edges.at(k).normal.dot(lens->at(middle_st.at(k).x(), middle_st.at(k).y()));
  const RadialField field = radial_field(edges, bend_px);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(bulge_px(field, edges.at(k)), bend_px.at(k), 0.02) << "one more bulge than unknowns";
  using Row = Eigen::Array<double, 1, 1>;
  double explained = 0;
  double all = 0;
  for (const double s : {-0.8, -0.3, 0.0, 0.4, 0.9}) {
    for (const double t : {-0.9, -0.4, 0.0, 0.5, 0.8}) {
      const Eigen::Vector2d u = (flat_px(s, t) - field.middle_px) / field.side_px;
      const auto off = field.at(Row(u.x()), Row(u.y()));
      const Eigen::Vector2d expected = lens->at(s, t);
      explained += (Eigen::Vector2d(off[0][0], off[1][0]) - expected).squaredNorm();
      all += expected.squaredNorm();
    }
  }
  EXPECT_LT(explained, 0.05 * all);
}

}  // namespace
}  // namespace waymark::refinement

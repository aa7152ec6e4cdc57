#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_camera.hpp"

namespace waymark {
namespace {

RC_GTEST_PROP(CameraJacobian, AgreesWithNumericDifferences, ()) {
  const CameraModel camera = testing::any_camera();
  const double reach = std::min(camera.max_angle_rad(), std::atan(3.0));
  const Eigen::Vector3d cam_p =
      testing::between(0.3, 5.0) * testing::direction(reach * testing::between(0, 0.98));
  Matrix23 J;
  const auto px = camera.project(cam_p, &J);
  RC_ASSERT(px.has_value());
  RC_ASSERT(*px == *camera.project(cam_p));
  const auto f = [&](const Eigen::Vector3d& p) { return camera.project(p).value(); };
  const Matrix23 expected = testing::numeric_jacobian<2, 3>(f, cam_p, 1e-3 * cam_p.norm());
  RC_ASSERT((J - expected).norm() < 1e-8 * expected.norm());
}

RC_GTEST_PROP(CameraJacobian, AlongTheRayIsZero, ()) {
  const CameraModel camera = testing::any_camera();
  const double reach = std::min(camera.max_angle_rad(), std::atan(10.0));
  const Eigen::Vector3d cam_p = testing::direction(reach * testing::near_one());
  Matrix23 J;
  RC_ASSERT(camera.project(cam_p, &J).has_value());
  RC_ASSERT((J * cam_p).norm() < 1e-13 * (J.norm() + camera.width_px()));
}

TEST(CameraJacobian, IsSmoothOnTheAxis) {
  const auto fisheye = CameraModel::make(
      Equidistant{.fx = 190, .fy = 200, .cx = 320, .cy = 240, .k = {0.1, 0, 0, 0}}, 640, 480);
  const auto radtan = CameraModel::make(
      PinholeRadtan{.fx = 190, .fy = 200, .cx = 320, .cy = 240, .k = {0.1}, .coefficients = 4}, 640, 480);
  ASSERT_TRUE(fisheye && radtan);
  Matrix23 on_axis;
  on_axis << 95, 0, 0, 0, 100, 0;  // f / z
  for (const CameraModel& camera : {*fisheye, *radtan}) {
    for (const double r : {0.0, 1e-320, 1e-300, 1e-160, 1e-20, 1e-12}) {
      Matrix23 J;
      const auto px = camera.project({r, -r, 2}, &J);
      ASSERT_TRUE(px);
      EXPECT_LT((*px - Eigen::Vector2d(320, 240)).norm(), 1e-9) << r;
      EXPECT_LT((J - on_axis).norm(), 1e-9) << r;
      const auto bearing = camera.unproject({320 + r, 240 - r});
      ASSERT_TRUE(bearing);
      EXPECT_LT((*bearing - Eigen::Vector3d(r / 190, -r / 200, 1)).norm(), 1e-15) << r;
    }
  }
}

}  // namespace
}  // namespace waymark

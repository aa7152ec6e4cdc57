// Compares the rolling-shutter shift with corners computed row by row, and analytic with numeric Jacobians.
#include "waymark/factors/rolling_shutter.hpp"

#include <gtest/gtest.h>

#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_pose.hpp"
#include "waymark/base/random.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr double kReadout_s = 0.03;

CameraModel lens() {
  PinholeRadtan radtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 5};
  radtan.k = {0.05, -0.08, 1e-3, -2e-3, 0.01, 0, 0, 0};
  return CameraModel::make(radtan, 640, 480).value();
}

MovingTag random_tag(Random& random) {
  MovingTag tag{.cam_T_tag = SE3({}, {0.1, -0.2, 1.5}) * testing::random_pose(random, 0.2, 0.6),
                .size_m = 0.16};
  for (double& v : tag.twist) v = random.uniform(-1, 1);
  for (double& a : tag.bend) a = random.uniform(-5, 5);
  return tag;
}

/// Each corner at the time when its row is read, found by a search in time that does not use the measured
/// row.
TagCorners corners_row_by_row(const MovingTag& tag, const CameraModel& camera) {
  TagCorners corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d p = tag_corners(tag.size_m)[i];
    double before = -kReadout_s;
    double after = kReadout_s;
    const auto at = [&](double t) {
      return *camera.project(SE3::exp(t * tag.twist + t * t / 2 * tag.bend) * tag.cam_T_tag * p);
    };
    for (int k = 0; k < 60; ++k) {
      const double t = (before + after) / 2;
      (t > (at(t).y() / camera.height_px() - 0.5) * kReadout_s ? after : before) = t;
    }
    corners[i] = at(before);
  }
  return corners;
}

TEST(RollingShutter, MeasuredCornersMinusTheShiftAreThoseOfTheMiddleRow) {
  const CameraModel camera = lens();
  Random random(7);
  for (int round = 0; round < 50; ++round) {
    const MovingTag tag = random_tag(random);
    const TagCorners measured = corners_row_by_row(tag, camera);
    const auto shift = rolling_shift(tag, measured, camera, kReadout_s);
    ASSERT_TRUE(shift);
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d middle = *camera.project(tag.cam_T_tag * tag_corners(tag.size_m)[i]);
      EXPECT_LT((measured[i] - shift->segment<2>(static_cast<Eigen::Index>(2 * i)) - middle).norm(), 1e-9);
    }
  }
}

TEST(RollingShutter, JacobianAgainstNumeric) {
  const CameraModel camera = lens();
  Random random(8);
  for (int round = 0; round < 20; ++round) {
    MovingTag tag = random_tag(random);
    const TagCorners measured = corners_row_by_row(tag, camera);
    Eigen::Matrix<double, 8, 6> J;
    ASSERT_TRUE(rolling_shift(tag, measured, camera, kReadout_s, &J));
    const auto of_twist = [&](const Vector6& twist) {
      return *rolling_shift({tag.cam_T_tag, twist, tag.size_m, tag.bend}, measured, camera, kReadout_s);
    };
    EXPECT_LT((testing::numeric_jacobian<8, 6>(of_twist, tag.twist) - J).norm(), 1e-6 * J.norm());
  }
}

TEST(RollingShutter, RowsReadFromTheBottomShiftTheOtherWay) {
  EXPECT_DOUBLE_EQ(row_time_s(0, 480, 0.02), -0.01);
  EXPECT_DOUBLE_EQ(row_time_s(480, 480, 0.02), 0.01);
  EXPECT_DOUBLE_EQ(row_time_s(480, 480, -0.02), -0.01);
}

TEST(RollingShutter, ATagBehindTheCameraHasNoShift) {
  const MovingTag tag{.cam_T_tag = SE3({}, {0, 0, -1}), .size_m = 0.1};
  EXPECT_FALSE(rolling_shift(tag, {}, lens(), kReadout_s));
}

}  // namespace
}  // namespace waymark

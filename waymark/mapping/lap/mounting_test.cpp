// Tests the camera mounting estimated from a lap. It is correct despite a wrong robot file, fixed if it is
// trusted, and unobservable if the lap does not determine it.
#include "waymark/mapping/lap/mounting.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"

namespace waymark {
namespace {

using test::drive_ring;
using test::RingDrive;

/// The mounting in a wrong robot file, which is rotated and displaced.
SE3 wrong(const SE3& base_T_cam) {
  return {SO3::from_rpy(0, 0, 0.04) * base_T_cam.rotation(),
          base_T_cam.translation() + Eigen::Vector3d(0, 0.02, 0)};
}

LapBundle taken_for(const RingDrive& drive, const SE3& base_T_cam) {
  RingDrive given = drive;
  given.lap.base_T_cam = base_T_cam;
  LapBundle lap = lap_bundle(given.lap, test::true_start(drive));
  EXPECT_TRUE(solve(lap.bundle).usable());
  return lap;
}

TEST(MountingEstimate, ACorrectFileHasNoSignificantOffset) {
  const RingDrive drive =
      drive_ring({.noise_px = 0.05, .odometry_sigma_m = 5e-4, .odometry_sigma_rad = 1e-3});
  LapBundle lap = taken_for(drive, drive.lap.base_T_cam);
  const auto estimate = estimate_mounting(lap, 100, {});
  ASSERT_TRUE(estimate);
  EXPECT_FALSE(estimate->any_significant());
  for (Eigen::Index i = 0; i < 6; ++i)
    EXPECT_LT(std::abs(estimate->off[i]), std::max(1e-3, 4 * estimate->sigma[i])) << i;
  EXPECT_EQ(estimate->focal_scale, 1);
  EXPECT_EQ(estimate->focal_scale_sigma, 0) << "it was not estimated";
}

TEST(MountingEstimate, AWrongMountingIsEstimatedWithinItsUncertainty) {
  const RingDrive drive =
      drive_ring({.noise_px = 0.05, .odometry_sigma_m = 5e-4, .odometry_sigma_rad = 1e-3});
  LapBundle lap = taken_for(drive, wrong(drive.lap.base_T_cam));
  const auto estimate = estimate_mounting(lap, 100, {});
  ASSERT_TRUE(estimate);
  Vector6 truth;
  truth << 0, -0.02, 0, 0, 0, -0.04;
  for (const Eigen::Index i : {0, 1, 3, 4, 5})
    EXPECT_LT(std::abs(estimate->off[i] - truth[i]), std::max(2e-3, 4 * estimate->sigma[i])) << i;
  EXPECT_LT((lap.bundle.poses[lap.cam].value.matrix() - estimate->base_T_cam.matrix()).norm(), 1e-12)
      << "the bundle keeps the result";
}

TEST(MountingEstimate, TheHeightIsUnobservableOnAFloor) {
  const RingDrive drive = drive_ring({.noise_px = 0.05});
  const SE3& truth = drive.lap.base_T_cam;
  LapBundle lap = taken_for(drive, SE3(truth.rotation(), truth.translation() + Eigen::Vector3d(0, 0, 0.1)));
  const auto estimate = estimate_mounting(lap, 100, {});
  ASSERT_TRUE(estimate);
  EXPECT_NEAR(estimate->off[2], 0, 1e-3) << "it keeps the given value";
  EXPECT_TRUE(estimate->unobservable[2]);
  EXPECT_FALSE(estimate->out[2]);
}

TEST(MountingEstimate, TrustedParametersAreFixed) {
  const RingDrive drive = drive_ring({.noise_px = 0.05});
  const SE3 given = wrong(drive.lap.base_T_cam);
  LapBundle lap = taken_for(drive, given);
  MountingAssumption assumption{.base_T_cam = given};
  assumption.trusted = {true, true, true, true, true, false};
  const auto estimate = estimate_mounting(lap, 100, {}, assumption);
  ASSERT_TRUE(estimate);
  for (const Eigen::Index i : {0, 1, 2, 3, 4}) {
    EXPECT_LT(std::abs(estimate->off[i]), 1e-3) << i;
    EXPECT_TRUE(estimate->unobservable[static_cast<std::size_t>(i)]) << i;
    EXPECT_FALSE(estimate->out[static_cast<std::size_t>(i)]) << i;
  }
}

TEST(MountingEstimate, TheFocalLengthIsEstimatedOnlyOnRequest) {
  const RingDrive drive = drive_ring({.noise_px = 0.05});
  LapBundle lap = taken_for(drive, drive.lap.base_T_cam);
  const auto estimate = estimate_mounting(
      lap, 100, {}, MountingAssumption{.base_T_cam = drive.lap.base_T_cam, .focal_share = 0.01});
  ASSERT_TRUE(estimate);
  EXPECT_GT(estimate->focal_scale_sigma, 0);
  EXPECT_LE(estimate->focal_scale_sigma, 0.01) << "at most the prior uncertainty";
  EXPECT_NEAR(estimate->focal_scale, 1, 4 * estimate->focal_scale_sigma);
}

TEST(MountingEstimate, FocalScaleIsTheMeanOfBothLengths) {
  Bundle bundle;
  bundle.intrinsics.push_back({.prior = Eigen::Vector4d(400, 500, 320, 240)});
  Eigen::Matrix4d P = Eigen::Matrix4d::Zero();
  P(0, 0) = 16;  // (1 % of fx)^2
  P(1, 1) = 25;  // (1 % of fy)^2
  EXPECT_NEAR(internal::focal_scale_sigma(bundle, P), 0.01 / std::sqrt(2.0), 1e-12) << "independent";
  P(0, 1) = P(1, 0) = 20;
  EXPECT_NEAR(internal::focal_scale_sigma(bundle, P), 0.01, 1e-12) << "fully correlated";
}

TEST(MountingEstimate, IsEmptyWithoutOdometryOrIfStopped) {
  RingDrive drive = drive_ring();
  LapBundle lap = taken_for(drive, drive.lap.base_T_cam);
  EXPECT_FALSE(estimate_mounting(lap, 100, [](int, double) { return false; }));
  drive.lap.odometry.clear();
  LapBundle without = taken_for(drive, drive.lap.base_T_cam);
  EXPECT_FALSE(estimate_mounting(without, 100, {}));
}

TEST(MountingHalves, AMountingNotConfirmedByTheHalvesIsUnobservable) {
  const RingDrive drive =
      drive_ring({.noise_px = 0.05, .odometry_sigma_m = 5e-4, .odometry_sigma_rad = 1e-3});
  LapBundle lap = taken_for(drive, drive.lap.base_T_cam);
  auto estimate = estimate_mounting(lap, 100, {});
  ASSERT_TRUE(estimate);
  estimate->out[1] = true;  // as if errors outside the noise model had made it significant
  internal::keep_confirmed(lap, drive.lap.base_T_cam, 100, {}, *estimate);
  EXPECT_FALSE(estimate->out[1]);
  EXPECT_TRUE(estimate->unobservable[1]);
}

TEST(MountingHalves, AMountingConfirmedByBothHalvesIsKept) {
  const RingDrive drive =
      drive_ring({.loops = 2, .noise_px = 0.05, .odometry_sigma_m = 5e-4, .odometry_sigma_rad = 1e-3});
  const SE3& truth = drive.lap.base_T_cam;
  // The camera looks down.
  const SE3 given(SO3::from_rpy(0, 0.04, 0) * truth.rotation(), truth.translation());
  LapBundle lap = taken_for(drive, given);
  auto estimate = estimate_mounting(lap, 100, {});
  ASSERT_TRUE(estimate);
  ASSERT_TRUE(estimate->out[4]) << "2.3 degrees, sigma " << estimate->sigma[4];
  internal::keep_confirmed(lap, given, 100, {}, *estimate);
  EXPECT_TRUE(estimate->out[4]);
  EXPECT_FALSE(estimate->unobservable[4]);
}

}  // namespace
}  // namespace waymark

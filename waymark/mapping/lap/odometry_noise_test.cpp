// The noise of wheels as it shows against known poses, and against tags.
#include "waymark/mapping/lap/odometry_noise.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"

namespace waymark {
namespace {

constexpr double kSigma_m = 0.002;
constexpr double kSigma_rad = 0.004;

/// Known poses along a bend, and wheels whose noise is so many times what they are taken for.
LapBundle known_poses(const Eigen::Vector3d& times, std::uint64_t seed, int steps = 1500) {
  Random random(seed);
  LapBundle lap;
  lap.bundle.odometry_scales.push_back({.fixed = true});
  SE2 at;
  PoseIndex before = lap.bundle.add(lift(at), true);
  const Eigen::Vector3d sigma(kSigma_m, kSigma_m, kSigma_rad);
  for (int i = 0; i < steps; ++i) {
    SE2::Tangent told(0.05, 0, 0.02);
    at = at * SE2::exp(told);
    for (Eigen::Index k = 0; k < 3; ++k) told[k] += times[k] * sigma[k] * random.normal();
    const PoseIndex here = lap.bundle.add(lift(at), true);
    OdometryFactor factor{SE2::exp(told), sigma.cwiseInverse().asDiagonal()};
    factor.duration_s = 0.1;
    lap.bundle.odometry.push_back({before, here, 0, factor});
    before = here;
  }
  // One pose that is free, so that there is something to adjust.
  const PoseIndex loose = lap.bundle.add({});
  lap.bundle.priors.push_back({loose, {{}, Matrix6::Identity()}});
  return lap;
}

TEST(OdometryNoise, IsWhatItWasTakenForWhereThatIsRight) {
  LapBundle lap = known_poses({1, 1, 1}, 1);
  const OdometryNoise noise = fit_odometry_noise(lap, 50);
  EXPECT_LT((noise - OdometryNoise::Ones()).cwiseAbs().maxCoeff(), 0.12);
}

/// Within a half of a second turns that err move a robot sideways as well: that is in what is found across.
TEST(OdometryNoise, IsFoundForEachOfItsPartsByItself) {
  for (const Eigen::Vector3d& times :
       {Eigen::Vector3d(3, 1, 1), Eigen::Vector3d(1, 2, 2), Eigen::Vector3d(0.4, 0.5, 0.3)}) {
    LapBundle lap = known_poses(times, 2);
    const OdometryNoise noise = fit_odometry_noise(lap, 50);
    for (Eigen::Index k = 0; k < 3; ++k)
      EXPECT_NEAR(noise[k] / times[k], 1, 0.2) << k << " of " << times.transpose();
    // The wheels weigh by it from now on.
    const Eigen::Vector3d weight = lap.bundle.odometry.front().factor.whitening.diagonal();
    const Eigen::Vector3d was(1 / kSigma_m, 1 / kSigma_m, 1 / kSigma_rad);
    EXPECT_LT((weight.cwiseProduct(noise) - was).norm(), 1e-6 * was.norm());
  }
}

TEST(OdometryNoise, ErrorsThatLastCountAsWhatHalfASecondShows) {
  LapBundle lap = known_poses({0, 0, 0}, 3);
  Random random(4);
  double off_m = 0;
  for (std::size_t i = 0; i < lap.bundle.odometry.size(); ++i) {
    if (i % 5 == 0) off_m = kSigma_m * random.normal();
    OdometryFactor& factor = lap.bundle.odometry[i].factor;
    SE2::Tangent told = factor.measured.log();
    told[1] += off_m;
    factor.measured = SE2::exp(told);
  }
  const OdometryNoise noise = fit_odometry_noise(lap, 50);
  // Five steps that err alike err by five times one, not by its square root.
  EXPECT_GT(noise[1], 1.4);
  EXPECT_LT(noise[1], 2.8);
  EXPECT_LT(noise[0], 0.5) << "nothing is wrong ahead";
}

TEST(OdometryNoise, IsFoundAgainstTagsAsWell) {
  const test::RingDrive drive = test::drive_ring(
      {.loops = 2, .noise_px = 0.05, .odometry_sigma_m = 0.012, .odometry_sigma_rad = 0.02, .seed = 5});
  LapBundle lap = lap_bundle(drive.lap, test::true_start(drive));
  const Eigen::Vector3d taken_for = lap.bundle.odometry.front().factor.whitening.diagonal().cwiseInverse();
  const OdometryNoise noise = fit_odometry_noise(lap, 30);
  EXPECT_NEAR(noise[0] * taken_for[0], 0.012, 0.004);
  EXPECT_NEAR(noise[2] * taken_for[2], 0.02, 0.006);
}

TEST(OdometryNoise, WithoutWheelsThereIsNone) {
  LapBundle lap;
  EXPECT_EQ(fit_odometry_noise(lap, 10), OdometryNoise::Ones());
}

TEST(OdometryNoise, EndsWhenItIsAskedTo) {
  LapBundle lap = known_poses({4, 4, 4}, 6, 200);
  int asked = 0;
  fit_odometry_noise(lap, 50, [&](int, double) {
    ++asked;
    return false;
  });
  EXPECT_EQ(asked, 1) << "the first search that is stopped is the last";
}

}  // namespace
}  // namespace waymark

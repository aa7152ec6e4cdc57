// Tests the corner noise that is estimated from the residuals of a lap, even if the fit uses up half of every
// observation. Tests the odometry noise estimated from known poses and from tags.
#include "waymark/mapping/lap/noise.hpp"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr double kSize_m = 0.16;
constexpr double kClaimed_px = 0.1;

CameraModel lens() {
  return CameraModel::make(PinholeRadtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 4}, 640,
                           480)
      .value();
}

/// A camera that moves along a wall of tags and observes only the nearest two. All poses are the true ones.
LapBundle walk(int frames) {
  constexpr int kTagsOfWall = 10;
  LapBundle lap;
  Bundle& bundle = lap.bundle;
  bundle.cameras = {lens()};
  lap.map = bundle.add({}, true);
  lap.cam = bundle.add({}, true);
  for (int i = 0; i < kTagsOfWall; ++i) {
    const SE3 map_T_tag(SO3::exp({0.4, 0.3 * (i % 3), 0}), Eigen::Vector3d(0.5 * i, 0.1 * (i % 2), 1.6));
    lap.tags[{FamilyId::Tag36h11, i}] = bundle.add(map_T_tag, i == 0);
  }
  for (int f = 0; f < frames; ++f) {
    const double along = (kTagsOfWall - 1.01) * f / frames;
    const PoseIndex base = bundle.add(SE3(SO3::exp({0, 0.05, 0.02}), Eigen::Vector3d(0.5 * along, 0, 0)));
    lap.bases.emplace_back(base);
    for (const int number : {static_cast<int>(along), static_cast<int>(along) + 1}) {
      const PoseIndex tag = lap.tags.at({FamilyId::Tag36h11, number});
      const auto corners = visible_corners(
          bundle.cameras[0], bundle.poses[base].value.inverse() * bundle.poses[tag].value, kSize_m);
      if (!corners) continue;
      TagDetection seen;
      seen.corners_px = *corners;
      const CornerFactor factor = corner_factor(seen, kSize_m, kClaimed_px).value();
      bundle.corners.push_back({base, lap.cam, lap.map, tag, 0, factor});
    }
  }
  return lap;
}

void add_noise(Bundle& bundle, double sigma_px, Random& random) {
  for (CornerTerm& term : bundle.corners) {
    for (auto& corner : term.factor.corners_px)
      corner += sigma_px * Eigen::Vector2d(random.normal(), random.normal());
  }
}

TEST(CornerNoise, TheUsedRedundancyIsTheNumberOfUnknowns) {
  const LapBundle lap = walk(60);
  ASSERT_EQ(lap.bundle.corners.size(), 120U);
  const std::vector<double> redundancy = internal::redundancy_of(lap);
  const double left = std::accumulate(redundancy.begin(), redundancy.end(), 0.0);
  EXPECT_NEAR(left, 8.0 * 120 - 6 * (60 + 9), 1e-2);
}

TEST(CornerNoise, IsEstimatedWithLittleRedundancy) {
  constexpr int kDraws = 20;
  constexpr double kTrue = 1.7;
  Random random(11);
  double mean = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    LapBundle lap = walk(100);
    add_noise(lap.bundle, kTrue * kClaimed_px, random);
    ASSERT_TRUE(solve(lap.bundle).usable());
    mean += internal::noise_ratio(corner_chi2(lap.bundle), internal::redundancy_of(lap)) / kDraws;
  }
  EXPECT_NEAR(mean, kTrue, 0.02 * kTrue);
}

TEST(CornerNoise, IsRobustAgainstOutliers) {
  LapBundle lap = walk(100);
  Random random(12);
  add_noise(lap.bundle, kClaimed_px, random);
  ASSERT_TRUE(solve(lap.bundle).usable());
  std::vector<double> chi2 = corner_chi2(lap.bundle);
  const std::vector<double> redundancy = internal::redundancy_of(lap);
  const double before = internal::noise_ratio(chi2, redundancy);
  for (std::size_t i = 0; i < chi2.size(); i += 20) chi2[i] = 1e4;
  chi2[1] = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(internal::noise_ratio(chi2, redundancy), before, 0.1 * before);
}

TEST(CornerNoise, IsOneForTooFewObservations) {
  EXPECT_EQ(internal::noise_ratio(std::vector<double>(49, 30.0), std::vector<double>(49, 6.0)), 1);
  EXPECT_EQ(internal::noise_ratio(std::vector<double>(99, 0.1), std::vector<double>(99, 1.0)), 1)
      << "one tag in each frame";
}

constexpr double kSigma_m = 0.002;
constexpr double kSigma_rad = 0.004;

/// Known poses along a bend, and odometry whose noise is `times` the assumed noise.
LapBundle known_poses(const Eigen::Vector3d& times, std::uint64_t seed, int steps = 1500) {
  Random random(seed);
  LapBundle lap;
  lap.bundle.odometry_scales.push_back({.fixed = true});
  SE2 at;
  PoseIndex before = lap.bundle.add(lift(at), true);
  const Eigen::Vector3d sigma(kSigma_m, kSigma_m, kSigma_rad);
  for (int i = 0; i < steps; ++i) {
    SE2::Tangent measured(0.05, 0, 0.02);
    at = at * SE2::exp(measured);
    for (Eigen::Index k = 0; k < 3; ++k) measured[k] += times[k] * sigma[k] * random.normal();
    const PoseIndex here = lap.bundle.add(lift(at), true);
    OdometryFactor factor{SE2::exp(measured), sigma.cwiseInverse().asDiagonal()};
    factor.duration_s = 0.1;
    lap.bundle.odometry.push_back({before, here, 0, factor});
    before = here;
  }
  // One pose is free, so that the problem has an unknown.
  const PoseIndex loose = lap.bundle.add({});
  lap.bundle.priors.push_back({loose, {{}, Matrix6::Identity()}});
  return lap;
}

TEST(OdometryNoise, IsOneForCorrectAssumptions) {
  LapBundle lap = known_poses({1, 1, 1}, 1);
  const OdometryNoise noise = fit_odometry_noise(lap, 50);
  EXPECT_LT((noise - OdometryNoise::Ones()).cwiseAbs().maxCoeff(), 0.12);
}

/// Over half a second, turn errors also move a robot sideways; this is included in the lateral noise.
TEST(OdometryNoise, IsEstimatedForEachDirection) {
  for (const Eigen::Vector3d& times :
       {Eigen::Vector3d(3, 1, 1), Eigen::Vector3d(1, 2, 2), Eigen::Vector3d(0.4, 0.5, 0.3)}) {
    LapBundle lap = known_poses(times, 2);
    const OdometryNoise noise = fit_odometry_noise(lap, 50);
    for (Eigen::Index k = 0; k < 3; ++k)
      EXPECT_NEAR(noise[k] / times[k], 1, 0.2) << k << " of " << times.transpose();
    // From now on, odometry is weighted according to the estimated noise.
    const Eigen::Vector3d weight = lap.bundle.odometry.front().factor.whitening.diagonal();
    const Eigen::Vector3d was(1 / kSigma_m, 1 / kSigma_m, 1 / kSigma_rad);
    EXPECT_LT((weight.cwiseProduct(noise) - was).norm(), 1e-6 * was.norm());
  }
}

TEST(OdometryNoise, PersistentErrorsCountOverHalfASecond) {
  LapBundle lap = known_poses({0, 0, 0}, 3);
  Random random(4);
  double off_m = 0;
  for (std::size_t i = 0; i < lap.bundle.odometry.size(); ++i) {
    if (i % 5 == 0) off_m = kSigma_m * random.normal();
    OdometryFactor& factor = lap.bundle.odometry[i].factor;
    SE2::Tangent measured = factor.measured.log();
    measured[1] += off_m;
    factor.measured = SE2::exp(measured);
  }
  const OdometryNoise noise = fit_odometry_noise(lap, 50);
  // Five steps with equal errors have five times the error of one step, instead of sqrt(5) times.
  EXPECT_GT(noise[1], 1.4);
  EXPECT_LT(noise[1], 2.8);
  EXPECT_LT(noise[0], 0.5) << "no longitudinal error";
}

TEST(OdometryNoise, IsEstimatedFromTags) {
  const test::RingDrive drive = test::drive_ring(
      {.loops = 2, .noise_px = 0.05, .odometry_sigma_m = 0.012, .odometry_sigma_rad = 0.02, .seed = 5});
  LapBundle lap = lap_bundle(drive.lap, test::true_start(drive));
  const Eigen::Vector3d taken_for = lap.bundle.odometry.front().factor.whitening.diagonal().cwiseInverse();
  const OdometryNoise noise = fit_odometry_noise(lap, 30);
  EXPECT_NEAR(noise[0] * taken_for[0], 0.012, 0.004);
  EXPECT_NEAR(noise[2] * taken_for[2], 0.02, 0.006);
}

TEST(OdometryNoise, IsOneWithoutOdometry) {
  LapBundle lap;
  EXPECT_EQ(fit_odometry_noise(lap, 10), OdometryNoise::Ones());
}

TEST(OdometryNoise, StopsOnRequest) {
  LapBundle lap = known_poses({4, 4, 4}, 6, 200);
  int asked = 0;
  fit_odometry_noise(lap, 50, [&](int, double) {
    ++asked;
    return false;
  });
  EXPECT_EQ(asked, 1) << "no search after the stopped one";
}

/// One minute of driving along bends. Odometry turns are `1 / scale` times the true ones, plus a random walk
/// of the heading.
struct Drive {
  Trajectory trajectory{};
  std::vector<Matrix6> covariance{};
  std::vector<Odometry> odometry{};
};

Drive drive_noisily(double scale, double noise_rad_sqrt_m, std::uint64_t seed) {
  constexpr double kDt_s = 0.02;
  constexpr double kSpeed_m_s = 0.3;
  Drive made;
  Random random(seed);
  SE2 truth;
  SE2 odom;
  for (int i = 0; i <= 6000; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(20 * i));
    made.odometry.push_back({.stamp = stamp, .odom_T_base = odom});
    if (i % 4 == 2) {
      made.trajectory.push_back({stamp, lift(truth)});
      made.covariance.emplace_back(1e-6 * Matrix6::Identity());
    }
    const double turn = kDt_s * 0.4 * std::sin(0.02 * i);
    const double slip = noise_rad_sqrt_m * std::sqrt(kSpeed_m_s * kDt_s) * random.normal();
    odom = odom * SE2::exp({kDt_s * kSpeed_m_s, 0, turn / scale});
    truth = truth * SE2::exp({kDt_s * kSpeed_m_s, 0, turn + slip});
  }
  return made;
}

TEST(TurnNoise, IsTheRemainingDifferenceAfterScaling) {
  for (const double noise : {0.01, 0.13}) {
    for (const double scale : {0.2, 1.2}) {
      const Drive made = drive_noisily(scale, noise, 7);
      const auto found = turn_noise(made.trajectory, made.covariance, made.odometry, scale);
      ASSERT_TRUE(found);
      EXPECT_GT(found->stretches, 100);
      EXPECT_NEAR(found->rad_sqrt_m, noise, 0.2 * noise) << scale;
      EXPECT_GT(found->scale_sigma, 0);
      EXPECT_LT(found->scale_sigma, 0.2 * scale);
    }
  }
}

TEST(TurnNoise, TheTurnScaleErrorIsConsistentWithItsSigma) {
  for (const double scale : {0.2, 1.0, 1.2}) {
    double squares = 0;
    constexpr int kDrives = 12;
    for (std::uint64_t seed = 1; seed <= kDrives; ++seed) {
      const Drive made = drive_noisily(scale, 0.02, seed);
      const auto found = turn_scale(made.trajectory, made.covariance, made.odometry);
      ASSERT_TRUE(found);
      const auto noise = turn_noise(made.trajectory, made.covariance, made.odometry, *found);
      ASSERT_TRUE(noise);
      squares += std::pow((*found - scale) / noise->scale_sigma, 2);
    }
    EXPECT_GT(squares / kDrives, 0.3) << scale;
    EXPECT_LT(squares / kDrives, 2.2) << scale;
  }
}

/// Bends to the left only, at a rate that varies by `share`; the odometry rate has a wandering error.
Drive one_sided(double share, std::uint64_t seed) {
  constexpr double kDt_s = 0.02;
  Drive made;
  Random random(seed);
  SE2 truth;
  SE2 odom;
  double bias_rad_s = 0.003;
  for (int i = 0; i <= 3000; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(20 * i));
    made.odometry.push_back({.stamp = stamp, .odom_T_base = odom});
    if (i % 4 == 2) {
      made.trajectory.push_back({stamp, lift(truth)});
      made.covariance.emplace_back(1e-6 * Matrix6::Identity());
    }
    bias_rad_s += 0.0006 * std::sqrt(kDt_s) * random.normal();
    const double rate = 0.13 * (1 + share * std::sin(0.005 * i));
    odom = odom * SE2::exp({kDt_s * 0.3, 0, kDt_s * (rate + bias_rad_s + 0.02 * random.normal())});
    truth = truth * SE2::exp({kDt_s * 0.3, 0, kDt_s * rate});
  }
  return made;
}

TEST(TurnNoise, OneSidedBendsAtOneRateDoNotDetermineTheScale) {
  const auto sigma = [](double share) {
    const Drive made = one_sided(share, 3);
    return turn_scale_sigma(made.trajectory, made.covariance, made.odometry).value();
  };
  EXPECT_GT(sigma(0.02), 0.05) << "scale and rate error are indistinguishable";
  EXPECT_LT(sigma(0.6), 0.01);
  EXPECT_LT(sigma(0.6), sigma(0.2));
  const Drive both_sides = drive_noisily(1, 0.02, 3);
  EXPECT_FALSE(turn_scale_sigma(both_sides.trajectory, both_sides.covariance, both_sides.odometry));
}

TEST(TurnNoise, IsEmptyIfHeadingsAreUncertain) {
  Drive made = drive_noisily(1, 0.01, 7);
  for (Matrix6& P : made.covariance) P(5, 5) = 0.1;
  EXPECT_FALSE(turn_noise(made.trajectory, made.covariance, made.odometry, 1));
  EXPECT_FALSE(turn_noise({}, {}, {}, 1));
}

}  // namespace
}  // namespace waymark

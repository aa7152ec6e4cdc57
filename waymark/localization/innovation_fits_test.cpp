#include "waymark/localization/innovation_fits.hpp"

#include <cstdio>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/support/mistaken_robot.hpp"

namespace waymark {
namespace {

using test::filtered;
using test::Mistake;
using test::mistaken_drive;
using test::mistaken_sensor;
using test::MistakenDrive;

TEST(KeptNumbers, SignificantChangesMoveAndOthersStay) {
  Eigen::VectorXd change = Eigen::Vector3d(0.5, 3, -1);
  const Eigen::MatrixXd P = Eigen::Matrix3d::Identity();
  EXPECT_EQ(keep_given(P, 2, change), (std::vector<bool>{true, false, true}));
  EXPECT_EQ(change, Eigen::VectorXd(Eigen::Vector3d(0, 3, 0)));
}

TEST(KeptNumbers, TheOthersMoveToTheirOptimumGivenIt) {
  const Eigen::Matrix2d H = (Eigen::Matrix2d() << 4, 1.5, 1.5, 2).finished();
  const Eigen::MatrixXd P = H.inverse();
  const Eigen::Vector2d best(5, 0.4);
  Eigen::VectorXd change = best;
  const auto kept = keep_given(P, 2, change);
  EXPECT_EQ(kept, (std::vector<bool>{false, true}));
  // The minimum of (x - best)' H (x - best) / 2 subject to x[1] = 0.
  EXPECT_NEAR(change[0], best[0] + H(0, 1) / H(0, 0) * best[1], 1e-12);
  EXPECT_EQ(change[1], 0);
}

TEST(KeptNumbers, OneOfTwoMovesIfOnlyTheirSumIsObservable) {
  // Their sum is well determined but their difference is not, so one of them has to move.
  const Eigen::Matrix2d H = (Eigen::Matrix2d() << 100.01, 100, 100, 100.01).finished();
  const Eigen::MatrixXd P = H.inverse();
  Eigen::VectorXd change = Eigen::Vector2d(1.0, 2.0);
  EXPECT_EQ(keep_given(P, 2, change), (std::vector<bool>{true, false}))
      << "individually, each has a standard deviation of 7";
  EXPECT_NEAR(change[1], 3, 1e-3);
}

// Tests that wrong parameters of the filter are found from a drive.

InnovationFit calibrated(const MistakenDrive& log, const RiekfOptions& options) {
  const auto fit =
      calibrate_by_innovations(log.samples, Landmarks(testing::ring()), testing::mounted_sensor(), options);
  EXPECT_TRUE(fit) << to_string(fit.error());
  return fit.value_or(InnovationFit{});
}

constexpr std::size_t index(Calibrated what) { return static_cast<std::size_t>(what); }

TEST(CalibrationByInnovations, FindsTheLatencyFromAnyStart) {
  const MistakenDrive log = mistaken_drive({.camera_latency_s = 0.06}, 60, 3);
  for (const double start_s : {-0.09, 0.0, 0.04, 0.08, 0.2}) {
    RiekfOptions options;
    options.camera_latency_s = start_s;
    const InnovationFit fit = calibrated(log, options);
    EXPECT_NEAR(fit.value[index(Calibrated::CameraLatency)], 0.06, 0.006) << "from " << start_s;
    EXPECT_TRUE(fit.improved) << "from " << start_s;
    EXPECT_LE(fit.held_out_after, fit.held_out_before);
  }
}

TEST(CalibrationByInnovations, FindsAFocalLengthWithoutChangingTheMounting) {
  const InnovationFit fit = calibrated(mistaken_drive({.focal_scale = 1.03}, 60, 4), {});
  EXPECT_NEAR(fit.value[index(Calibrated::FocalScale)], 1.03, 0.005);
  EXPECT_NEAR(fit.value[index(Calibrated::MountingX)], 0, 0.01);
  EXPECT_NEAR(fit.value[index(Calibrated::MountingYaw)], 0, 0.01);
}

TEST(CalibrationByInnovations, FindsAMountingFarFromTheGivenOne) {
  const Mistake truth{.wrong_mounting = SE3(SO3::exp({0, 0, -0.08}), Eigen::Vector3d(0.09, -0.09, 0))};
  const InnovationFit fit = calibrated(mistaken_drive(truth, 60, 5), {});
  const SE3 found = calibrated_sensor(testing::mounted_sensor(), fit.value).base_T_sensor;
  const SE3 true_place = mistaken_sensor(truth).base_T_sensor;
  EXPECT_LT((found.translation() - true_place.translation()).norm(), 0.02);
  EXPECT_LT((found.rotation().inverse() * true_place.rotation()).angle(), 0.02);
  EXPECT_TRUE(fit.improved);
}

TEST(CalibrationByInnovations, ReportsAnImprovementOnlyIfTheHeldOutPartImproves) {
  for (std::uint64_t seed = 11; seed <= 14; ++seed) {
    const InnovationFit fit = calibrated(mistaken_drive({}, 30, seed), {});
    if (fit.improved) {
      EXPECT_LT(fit.held_out_after, fit.held_out_before) << "seed " << seed;
      EXPECT_LT(fit.cost_after, fit.cost_before) << "seed " << seed;
    }
  }
}

TEST(NoiseAdaptation, FindsAnUnknownTurnNoise) {
  const MistakenDrive log = mistaken_drive({.yaw_noise_rad_sqrt_s = 0.2}, 60, 6);
  const NoiseFit fit = adapt_noise(log.samples, Landmarks(testing::ring()), testing::mounted_sensor(), {});
  const double before = filtered(log).nees;
  const double after = filtered(log, fit.options).nees;
  std::printf("  turn noise x %.1f; NEES %.1f, adapted %.1f\n", fit.turn_ratio, before, after);
  EXPECT_TRUE(fit.adapted);
  EXPECT_GT(fit.turn_ratio, 4);
  EXPECT_LT(after, 6);
}

}  // namespace
}  // namespace waymark

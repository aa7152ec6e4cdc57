#include "waymark/localization/watches.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "tests/support/golden_page.hpp"
#include "tests/support/laser_robot.hpp"
#include "tests/support/mistaken_robot.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using test::filtered;
using test::FilterOutcome;
using test::findings;
using test::laser_filter;
using test::laser_points;
using test::LaserRobot;
using test::Mistake;
using test::mistaken_drive;
using test::MistakenDrive;
using test::wrong_mounting;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// Both copies of a duplicate tag are observed equally often, so contradictions are not in the majority.
TEST(TagWatch, ReportsADuplicateTag) {
  const Landmarks landmarks = Landmarks::of_points(laser_points()).value();
  TagWatch watch(landmarks);
  const Eigen::Vector2d second = landmarks[2].map_T_tag.translation().head<2>() + Eigen::Vector2d(1, 0.5);
  for (int i = 0; i < 100; ++i) {
    watch.add({.landmark = 1, .nis_per_row = 1, .accepted = true});
    watch.add({.landmark = 2, .nis_per_row = 1, .accepted = true});
    watch.add({.landmark = 2, .nis_per_row = 300, .map_p_implied = second});
    watch.confirm();
  }
  ASSERT_EQ(watch.findings().size(), 1U);
  EXPECT_THAT(watch.findings().front(), AllOf(HasSubstr("tag 3"), HasSubstr("1.12 m")));
  testing::expect_on_page("localize", watch.findings().front());
}

constexpr double kPeriod_s = 0.02;

MotionStep step_at(double speed_m_s, double yaw_rate_rad_s = 0) {
  return {.twist = {speed_m_s * kPeriod_s, 0, yaw_rate_rad_s * kPeriod_s},
          .dt_s = kPeriod_s,
          .standing = speed_m_s == 0};
}

TEST(SuddenHalt, AddsTheDistanceThatTheRobotWouldHaveDriven) {
  SuddenHalt halt;
  EXPECT_EQ(halt.advance(step_at(0.3)).extra_m2, 0);
  double variance_m2 = 0;
  for (int i = 0; i < 10; ++i) {
    const MotionStep stopped = halt.advance(step_at(0));
    EXPECT_FALSE(stopped.standing);
    variance_m2 += stopped.extra_m2;
  }
  EXPECT_NEAR(std::sqrt(variance_m2), 0.3 * 10 * kPeriod_s, 1e-9);
}

TEST(SuddenHalt, AddsHeadingVarianceOnlyWithoutAGyro) {
  for (const double gyro_rad_s : {0.0, 0.28}) {
    SuddenHalt halt;
    (void)halt.advance(step_at(0.3, 0.3));
    const double extra_rad2 = halt.advance(step_at(0, gyro_rad_s)).extra_rad2;
    EXPECT_NEAR(extra_rad2, gyro_rad_s == 0 ? std::pow(0.3 * kPeriod_s, 2) : 0, 1e-12);
  }
}

TEST(SuddenHalt, AcceptsABrakingRobot) {
  SuddenHalt halt;
  for (double speed_m_s = 0.8; speed_m_s > 0; speed_m_s -= 5 * kPeriod_s)
    (void)halt.advance(step_at(speed_m_s));
  const MotionStep stopped = halt.advance(step_at(0));
  EXPECT_FALSE(halt.suspected());
  EXPECT_EQ(stopped.extra_m2, 0);
  EXPECT_TRUE(stopped.standing);
}

TEST(SuddenHalt, AcceptsSlowOdometry) {
  SuddenHalt halt;
  (void)halt.advance({.twist = {0.03, 0, 0}, .dt_s = 0.1});
  EXPECT_EQ(halt.advance({.dt_s = 0.1}).extra_m2, 0) << "stopping from 0.3 m/s within 0.1 s is possible";
  SuddenHalt divided;
  (void)divided.advance({.twist = {0.003, 0, 0}, .dt_s = 0.01, .share = 0.1});
  EXPECT_EQ(divided.advance({.dt_s = 0.01, .share = 0.1}).extra_m2, 0)
      << "a tenth of such a message, split off by an observation";
}

TEST(SuddenHalt, TagsConfirmOrRefuteTheHalt) {
  SuddenHalt halted;
  SuddenHalt moves;
  (void)halted.advance(step_at(0.3));
  (void)moves.advance(step_at(0.3));
  for (int i = 0; i < 4; ++i) {
    (void)halted.advance(step_at(0));
    (void)moves.advance(step_at(0));
  }
  halted.observe_correction(0.002);
  moves.observe_correction(0.024);
  EXPECT_FALSE(halted.suspected());
  EXPECT_TRUE(moves.suspected());
  EXPECT_NEAR(moves.advance(step_at(0)).extra_m2, std::pow(0.3 * kPeriod_s, 2), 1e-12)
      << "the time is counted from the image with tags";
  EXPECT_EQ(moves.advance(step_at(0.3)).extra_m2, 0) << "the encoders are counting again";
}

// Simulates drives past landmarks with lasting errors, and with motion errors that are shared within an
// interval. The variances must match the errors of the parameters.

using Rows = Eigen::Matrix<double, 8, 1>;

constexpr int kLandmarks = 24;
constexpr int kMoments = 30;

template <class Matrix>
Matrix normal(Random& random) {
  Matrix drawn;
  for (Eigen::Index i = 0; i < drawn.size(); ++i) drawn(i) = random.normal();
  return drawn;
}

/// Squared errors divided by variances, over all parameters: with clusters, and as if all innovations were
/// independent.
struct Scores {
  double clusters = 0, alone = 0;
};

/// Each landmark is in view for some intervals and has a lasting error; each interval has its own error.
Scores drive(std::uint64_t seed) {
  constexpr int kInView = 5;
  constexpr int kLooks = 10;
  constexpr double kLasting = 1, kOfMoment = 0.3;
  Random random(seed);
  std::array<Rows, kMoments> of_moment;
  for (Rows& error : of_moment) error = kOfMoment * normal<Rows>(random);
  ScoreClusters clusters;
  ScoreSums all{.information = SystematicMatrix::Identity() * 1e-6};
  for (int landmark = 0; landmark < kLandmarks; ++landmark) {
    const StateBySystematic seen = normal<StateBySystematic>(random);
    const Rows lasting = kLasting * normal<Rows>(random);
    const int first = landmark * (kMoments - kInView) / kLandmarks;
    for (int look = 0; look < kInView * kLooks; ++look) {
      const int moment = first + look / kLooks;
      const StateBySystematic A = seen + 0.5 * normal<StateBySystematic>(random);
      const Rows r = lasting + of_moment.at(static_cast<std::size_t>(moment)) + normal<Rows>(random);
      const ScoreSums sum{A.transpose() * A, A.transpose() * r, 1};
      clusters.add(landmark, SensorTime(std::chrono::milliseconds(2000 * moment + 100 * look % 2000)), sum);
      all += sum;
    }
  }
  const SystematicVector value = all.information.ldlt().solve(all.score);  // the true value is zero
  const SystematicVector alone = all.information.inverse().diagonal();
  return {value.cwiseAbs2().cwiseQuotient(clusters.variances(all.information, value)).mean(),
          value.cwiseAbs2().cwiseQuotient(alone).mean()};
}

TEST(ScoreClusters, VariancesMatchTheErrors) {
  constexpr int kDrives = 100;
  Scores sum;
  for (std::uint64_t seed = 1; seed <= kDrives; ++seed) {
    const Scores scores = drive(seed);
    sum.clusters += scores.clusters / kDrives;
    sum.alone += scores.alone / kDrives;
  }
  std::printf("  errors over standard deviations, RMS: %.2f by clusters, %.2f as if independent\n",
              std::sqrt(sum.clusters), std::sqrt(sum.alone));
  EXPECT_GT(std::sqrt(sum.clusters), 0.85);
  EXPECT_LT(std::sqrt(sum.clusters), 1.15);
  EXPECT_GT(std::sqrt(sum.alone), 2);
}

TEST(ScoreClusters, VariancesAreZeroForFewGroups) {
  Random random(1);
  ScoreClusters clusters;
  for (int i = 0; i < 30; ++i)
    clusters.add(i % 3, SensorTime(std::chrono::milliseconds(200 * i)),
                 {SystematicMatrix::Identity(), normal<SystematicVector>(random), 1});
  const SystematicMatrix information = 31 * SystematicMatrix::Identity();
  EXPECT_EQ(clusters.variances(information, SystematicVector::Zero()), SystematicVector::Zero());
  clusters.add(0, SensorTime(std::chrono::seconds(7)),
               {SystematicMatrix::Identity(), normal<SystematicVector>(random), 1});
  EXPECT_GT(clusters.variances(information, SystematicVector::Zero()).minCoeff(), 0);
}

// If parameters of the filter are wrong, the suspect must be identified, its size estimated, and the
// covariance inflated.

TEST(SystematicErrors, AreNotReportedForACorrectRobot) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const FilterOutcome outcome = filtered(mistaken_drive({}, 60, seed));
    EXPECT_FALSE(outcome.suspect) << "seed " << seed << ": " << outcome.problems.front();
    EXPECT_TRUE(outcome.problems.empty()) << outcome.problems.front();
  }
}

TEST(SystematicErrors, AreIdentifiedAndCoveredByTheCovariance) {
  const std::array<std::pair<Mistake, Suspect>, 3> cases{
      {{wrong_mounting(), Suspect::Mounting},
       {{.focal_scale = 1.03}, Suspect::Scale},
       {{.camera_latency_s = 0.06}, Suspect::CameraLatency}}};
  for (const auto& [truth, suspect] : cases) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const MistakenDrive log = mistaken_drive(truth, 60, seed);
      const FilterOutcome outcome = filtered(log);
      ASSERT_TRUE(outcome.suspect) << "seed " << seed;
      EXPECT_EQ(outcome.suspect->suspect, suspect) << "seed " << seed << ": " << outcome.problems.front();
      const FilterOutcome again = filtered(log, {}, outcome.suspect);
      std::printf("  %d, seed %d: chi2 %.0f, NEES %.1f, given before %.1f\n", static_cast<int>(suspect),
                  static_cast<int>(seed), outcome.suspect->chi2, outcome.nees, again.nees);
      EXPECT_LT(again.nees, 8);
    }
  }
}

TEST(SystematicErrors, AreEstimatedFromTheInnovations) {
  const FilterOutcome focal = filtered(mistaken_drive({.focal_scale = 1.03}, 60, 1));
  ASSERT_TRUE(focal.suspect);
  EXPECT_NEAR(focal.suspect->fit.value[6], 0.03, 0.006);
  const FilterOutcome late = filtered(mistaken_drive({.camera_latency_s = 0.06}, 60, 1));
  ASSERT_TRUE(late.suspect);
  EXPECT_NEAR(late.suspect->fit.value[7], 0.06, 0.02);
}

/// With a misplaced laser, single observations pass the gate, but the innovations show the error. A correct
/// robot produces no findings.
TEST(SystematicErrors, DetectsAMisplacedLaser) {
  for (const double laser_x_m : {0.0, 0.5}) {
    RiekfLocalizer filter = laser_filter();
    LaserRobot robot{.laser_x_m = laser_x_m};
    filter.start_from(robot.truth, 0.05, 0.05);
    robot.drive(filter, 60);
    const auto lasting = filter.tracker().lasting_nis();
    ASSERT_TRUE(lasting);
    if (laser_x_m > 0) {
      EXPECT_GT(*lasting, 2);
      EXPECT_FALSE(filter.problems().empty());
      testing::expect_on_page("localize", findings(filter));
    } else {
      EXPECT_GT(*lasting, 0.1);  // includes the error of the estimate
      EXPECT_LT(*lasting, 1.5);
      EXPECT_TRUE(filter.problems().empty());
    }
  }
}

}  // namespace
}  // namespace waymark

// Numbers that a filter takes for right and that are wrong: named, their size told, the covariance inflated,
// and found by calibration.
#include "waymark/localization/systematic_errors.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/support/tag_ring.hpp"
#include "waymark/localization/innovation_calibration.hpp"
#include "waymark/localization/noise_adaptation.hpp"

namespace waymark {
namespace {

using testing::at;

/// How the robot differs from what its filter is told.
struct Truth {
  SE3 wrong_mounting{};  ///< left tangent in base
  double focal_scale = 1;
  double latency_s = 0;
  double yaw_noise_rad_sqrt_s = 1e-3;
};

struct Drive {
  std::vector<Sample> samples{};
  std::vector<std::pair<SensorTime, SE2>> truth{};
};

/// The sensor as it is.
MountedSensor sensor_of(const Truth& truth) {
  MountedSensor sensor = testing::mounted_sensor();
  sensor.base_T_sensor = truth.wrong_mounting * sensor.base_T_sensor;
  CalibratedNumbers numbers{0, 0, 0, 1, 1, 1, 0, 1, 0, 0, 0, truth.focal_scale};
  return calibrated_sensor(sensor, numbers);
}

/// Bends to both sides at changing speeds in the ring of tags. Tags hang 2 mm and 2 mrad from their places.
Drive drive(const Truth& truth, double seconds, std::uint64_t seed) {
  Random random(seed);
  TagMap hung = testing::ring();
  for (auto& [id, tag] : hung.tags) {
    Eigen::Matrix<double, 6, 1> off;
    for (double& x : off) x = 0.002 * random.normal();
    tag.map_T_tag =
        SE3(SO3::exp(off.tail<3>()) * tag.map_T_tag.rotation(), tag.map_T_tag.translation() + off.head<3>());
  }
  const MountedSensor sensor = sensor_of(truth);
  Drive log;
  SE2 map_T_base(0, -1, 0);
  SE2 odom;
  constexpr double kStep = 0.02;
  for (int i = 0; i < static_cast<int>(seconds / kStep); ++i) {
    const double now = 10 + kStep * i;
    const double speed = std::fmod(now, 14) < 7 ? 0.25 : 0.5;
    const double rate = speed / 1.1 + 0.5 * std::sin(0.9 * now);
    const Eigen::Vector3d u(speed * kStep, 0, rate * kStep);
    map_T_base = map_T_base * SE2::exp(u);
    odom = odom * SE2::exp({1.01 * u.x() + 1e-3 * std::sqrt(kStep) * random.normal(), 0,
                            u.z() + truth.yaw_noise_rad_sqrt_s * std::sqrt(kStep) * random.normal()});
    const SensorTime stamp = at(now + kStep);
    log.samples.emplace_back(Odometry{.stamp = stamp, .odom_T_base = odom});
    log.truth.emplace_back(stamp, map_T_base);
    if (i % 4 != 0) continue;
    TagFrame frame{.stamp = at(now + kStep + truth.latency_s)};
    const SE3 cam_T_map = (lift(map_T_base) * sensor.base_T_sensor).inverse();
    for (const auto& [id, tag] : hung.tags) {
      const auto corners = visible_corners(*sensor.camera, cam_T_map * tag.map_T_tag, tag.size_m);
      if (!corners) continue;
      TagDetection seen{.tag = id, .corners_px = *corners};
      for (auto& corner : seen.corners_px) corner += 0.15 * Eigen::Vector2d(random.normal(), random.normal());
      seen.corner_covariance_px2 = CornerCovariance::Identity() * 0.15 * 0.15;
      frame.detections.push_back(seen);
    }
    log.samples.emplace_back(frame);
  }
  std::ranges::stable_sort(log.samples, {}, stamp_of);
  return log;
}

struct Outcome {
  std::optional<SystematicVerdict> suspect{};
  double nees = 0;
  std::vector<std::string> problems{};
};

Outcome run(const Drive& log, const RiekfOptions& options = {},
            const std::optional<SystematicVerdict>& before = {}) {
  RiekfLocalizer filter(Landmarks(testing::ring()), testing::mounted_sensor(), options);
  if (before) filter.tracker().suspect(*before);
  Outcome outcome;
  int count = 0;
  std::size_t next = 0;
  for (const Sample& sample : log.samples) {
    if (const auto* odometry = std::get_if<Odometry>(&sample)) filter.add(*odometry);
    if (const auto* tags = std::get_if<TagFrame>(&sample)) filter.add(*tags);
    filter.clear_comparisons();
    const auto estimate = filter.estimate();
    if (!estimate || !estimate->certain) continue;
    while (next < log.truth.size() && log.truth[next].first < estimate->stamp) ++next;
    if (next == log.truth.size() || log.truth[next].first != estimate->stamp) continue;
    const SE2& truth = log.truth[next].second;
    const Eigen::Vector3d e(estimate->map_T_base.x() - truth.x(), estimate->map_T_base.y() - truth.y(),
                            (truth.inverse() * estimate->map_T_base).yaw());
    outcome.nees += e.dot(estimate->covariance.inverse() * e);
    ++count;
  }
  outcome.nees /= std::max(1, count);
  outcome.suspect = filter.tracker().suspect();
  outcome.problems = filter.problems();
  return outcome;
}

Truth wrong_mounting() {
  return {.wrong_mounting = SE3(SO3::exp({0, 0, 0.035}), Eigen::Vector3d(0.02, 0.03, 0))};
}

TEST(SystematicErrors, AreNotSeenWhereThereAreNone) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Outcome outcome = run(drive({}, 60, seed));
    EXPECT_FALSE(outcome.suspect) << "seed " << seed << ": " << outcome.problems.front();
    EXPECT_TRUE(outcome.problems.empty()) << outcome.problems.front();
  }
}

TEST(SystematicErrors, AreNamedAndTheCovarianceCoversThem) {
  const std::array<std::pair<Truth, Suspect>, 3> cases{{{wrong_mounting(), Suspect::Mounting},
                                                        {{.focal_scale = 1.03}, Suspect::Scale},
                                                        {{.latency_s = 0.06}, Suspect::Latency}}};
  for (const auto& [truth, suspect] : cases) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const Drive log = drive(truth, 60, seed);
      const Outcome outcome = run(log);
      ASSERT_TRUE(outcome.suspect) << "seed " << seed;
      EXPECT_EQ(outcome.suspect->suspect, suspect) << "seed " << seed << ": " << outcome.problems.front();
      const Outcome again = run(log, {}, outcome.suspect);
      std::printf("  %d, seed %d: chi2 %.0f, NEES %.1f, told before %.1f\n", static_cast<int>(suspect),
                  static_cast<int>(seed), outcome.suspect->chi2, outcome.nees, again.nees);
      EXPECT_LT(again.nees, 8);
    }
  }
}

TEST(SystematicErrors, HaveTheSizeThatTheInnovationsTell) {
  const Outcome focal = run(drive({.focal_scale = 1.03}, 60, 1));
  ASSERT_TRUE(focal.suspect);
  EXPECT_NEAR(focal.suspect->fit.value[6], 0.03, 0.006);
  const Outcome late = run(drive({.latency_s = 0.06}, 60, 1));
  ASSERT_TRUE(late.suspect);
  EXPECT_NEAR(late.suspect->fit.value[7], 0.06, 0.02);
}

InnovationFit calibrated(const Drive& log, const RiekfOptions& options) {
  const auto fit =
      calibrate_by_innovations(log.samples, Landmarks(testing::ring()), testing::mounted_sensor(), options);
  EXPECT_TRUE(fit) << to_string(fit.error());
  return fit.value_or(InnovationFit{});
}

constexpr std::size_t index(Calibrated what) { return static_cast<std::size_t>(what); }

TEST(CalibrationByInnovations, FindsTheLatencyFromAnyStart) {
  const Drive log = drive({.latency_s = 0.06}, 60, 3);
  for (const double start_s : {-0.09, 0.0, 0.04, 0.08, 0.2}) {
    RiekfOptions options;
    options.camera_latency_s = start_s;
    const InnovationFit fit = calibrated(log, options);
    EXPECT_NEAR(fit.value[index(Calibrated::CameraLatency)], 0.06, 0.006) << "from " << start_s;
    EXPECT_TRUE(fit.improved) << "from " << start_s;
    EXPECT_LE(fit.held_out_after, fit.held_out_before);
  }
}

TEST(CalibrationByInnovations, FindsAFocalLengthAndDoesNotMoveTheCameraForIt) {
  const InnovationFit fit = calibrated(drive({.focal_scale = 1.03}, 60, 4), {});
  EXPECT_NEAR(fit.value[index(Calibrated::FocalScale)], 1.03, 0.005);
  EXPECT_NEAR(fit.value[index(Calibrated::MountingX)], 0, 0.01);
  EXPECT_NEAR(fit.value[index(Calibrated::MountingYaw)], 0, 0.01);
}

TEST(CalibrationByInnovations, FindsAMountingFarFromWhatWasGiven) {
  const Truth truth{.wrong_mounting = SE3(SO3::exp({0, 0, -0.08}), Eigen::Vector3d(0.09, -0.09, 0))};
  const InnovationFit fit = calibrated(drive(truth, 60, 5), {});
  const SE3 found = calibrated_sensor(testing::mounted_sensor(), fit.value).base_T_sensor;
  const SE3 true_place = sensor_of(truth).base_T_sensor;
  EXPECT_LT((found.translation() - true_place.translation()).norm(), 0.02);
  EXPECT_LT((found.rotation().inverse() * true_place.rotation()).angle(), 0.02);
  EXPECT_TRUE(fit.improved);
}

TEST(CalibrationByInnovations, NeverCallsWorseWhatItChanged) {
  for (std::uint64_t seed = 11; seed <= 14; ++seed) {
    const InnovationFit fit = calibrated(drive({}, 30, seed), {});
    if (fit.improved) {
      EXPECT_LT(fit.held_out_after, fit.held_out_before) << "seed " << seed;
      EXPECT_LT(fit.cost_after, fit.cost_before) << "seed " << seed;
    }
  }
}

TEST(NoiseAdaptation, FindsTheNoiseOfTurningThatNobodyTold) {
  const Drive log = drive({.yaw_noise_rad_sqrt_s = 0.2}, 60, 6);
  const NoiseFit fit = adapt_noise(log.samples, Landmarks(testing::ring()), testing::mounted_sensor(), {});
  const double before = run(log).nees;
  const double after = run(log, fit.options).nees;
  std::printf("  turn noise x %.1f; NEES %.1f, adapted %.1f\n", fit.turn_ratio, before, after);
  EXPECT_TRUE(fit.adapted);
  EXPECT_GT(fit.turn_ratio, 4);
  EXPECT_LT(after, 6);
}

}  // namespace
}  // namespace waymark

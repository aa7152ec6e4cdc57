#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/LU>

#include "tests/support/tag_ring.hpp"
#include "waymark/localization/innovation_fits.hpp"

/// Drives in the ring of tags with a robot that differs from the configuration of its filter.
namespace waymark::test {

/// Difference between the robot and the configuration of its filter.
struct Mistake {
  SE3 wrong_mounting{};  ///< left tangent in base
  double focal_scale = 1;
  double camera_latency_s = 0;
  double yaw_noise_rad_sqrt_s = 1e-3;
};

struct MistakenDrive {
  std::vector<Sample> samples{};
  std::vector<std::pair<SensorTime, SE2>> truth{};
};

/// The true sensor.
inline MountedSensor mistaken_sensor(const Mistake& truth) {
  MountedSensor sensor = testing::mounted_sensor();
  sensor.base_T_sensor = truth.wrong_mounting * sensor.base_T_sensor;
  CalibratedNumbers numbers{0, 0, 0, 1, 1, 1, 0, 1, 0, 0, 0, truth.focal_scale};
  return calibrated_sensor(sensor, numbers);
}

/// Bends to both sides at changing speeds in the ring of tags. Tags are 2 mm and 2 mrad off their map poses.
inline MistakenDrive mistaken_drive(const Mistake& truth, double seconds, std::uint64_t seed) {
  Random random(seed);
  TagMap hung = testing::ring();
  for (auto& [id, tag] : hung.tags) {
    Eigen::Matrix<double, 6, 1> off;
    for (double& x : off) x = 0.002 * random.normal();
    tag.map_T_tag =
        SE3(SO3::exp(off.tail<3>()) * tag.map_T_tag.rotation(), tag.map_T_tag.translation() + off.head<3>());
  }
  const MountedSensor sensor = mistaken_sensor(truth);
  MistakenDrive log;
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
    const SensorTime stamp = testing::at(now + kStep);
    log.samples.emplace_back(Odometry{.stamp = stamp, .odom_T_base = odom});
    log.truth.emplace_back(stamp, map_T_base);
    if (i % 4 != 0) continue;
    TagFrame frame{.stamp = testing::at(now + kStep + truth.camera_latency_s)};
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

struct FilterOutcome {
  std::optional<SystematicVerdict> suspect{};
  double nees = 0;
  std::vector<std::string> problems{};
};

inline FilterOutcome filtered(const MistakenDrive& log, const RiekfOptions& options = {},
                              const std::optional<SystematicVerdict>& before = {}) {
  RiekfLocalizer filter(Landmarks(testing::ring()), testing::mounted_sensor(), options);
  if (before) filter.tracker().suspect(*before);
  FilterOutcome outcome;
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

inline Mistake wrong_mounting() {
  return {.wrong_mounting = SE3(SO3::exp({0, 0, 0.035}), Eigen::Vector3d(0.02, 0.03, 0))};
}

}  // namespace waymark::test

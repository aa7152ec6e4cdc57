#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include <Eigen/Geometry>

#include "waymark/base/random.hpp"
#include "waymark/localization/sensor_explanation.hpp"

/// A drive along a winding course, as measured by wheels, a gyro and tags, any of which may have a fault.
namespace waymark::test {

struct SyntheticMotion {
  std::uint64_t seed = 1;
  double duration_s = 60;
  double turning = 1;  ///< factor on the yaw rate of the course
  bool tags = true;
  double wheel_noise = 1;  ///< relative to that of good wheels
  double gyro_noise_rad_s = 0.003;
  double gyro_bias_rad_s = 0.004;
  double observed_noise = 1;  ///< relative to that of good tags
  /// Angular velocity as measured, from that in base axes.
  Eigen::Matrix3d gyro_from_base = Eigen::Matrix3d::Identity();
  double measured_turn = 1;  ///< of the wheels, over the true one
  double measured_distance = 1;
  double observed_distance = 1;
  double gyro_late_s = 0;
  double odometry_late_s = 0;
  double observed_late_s = 0;
};

namespace internal {

inline SensorTime stamp_at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

/// Speed [m/s] and yaw rate [rad/s] at a time. The robot stops now and then.
struct Course {
  double speed_phase = 0;
  double turn_phase = 0;
  double direction = 1;

  [[nodiscard]] double speed(double t) const {
    const double wave = std::sin(0.31 * t + speed_phase);
    return wave < -0.85 ? 0 : 0.3 + 0.1 * wave;
  }
  [[nodiscard]] double yaw_rate(double t) const {
    return speed(t) / 0.3 * direction *
           (0.25 + 0.2 * std::sin(0.4 * t + turn_phase) + 0.1 * std::sin(1.3 * t + 2 * turn_phase));
  }
};

}  // namespace internal

inline MotionSources motion_sources(const SyntheticMotion& motion) {
  using internal::stamp_at;
  constexpr double kStep_s = 0.002;
  constexpr double kEpoch_s = 1700000000;
  Random course_random(motion.seed);
  Random wheels = course_random.fork();
  Random gyro = course_random.fork();
  Random tags = course_random.fork();
  internal::Course course;
  course.speed_phase = course_random.uniform(0, 6.28);
  course.turn_phase = course_random.uniform(0, 6.28);
  course.direction = course_random.uniform() < 0.5 ? 1 : -1;
  const double wheel_scale = 1 + 0.005 * course_random.normal();
  const double wheel_yaw_scale = 1 + 0.01 * course_random.normal();
  MotionSources sources;
  SE2 truth;
  SE2 odom(1, 2, 0.5);
  SE2 last;
  std::optional<SE2> fix;
  const auto steps = static_cast<int>(motion.duration_s / kStep_s);
  for (int i = 0; i < steps; ++i) {
    const double t = kStep_s * i;
    const double yaw_rate = motion.turning * course.yaw_rate(t);
    if (i % 5 == 0) {
      Eigen::Vector3d base_w(0.01 * gyro.normal(), 0, 0);
      base_w.y() = 0.01 * gyro.normal();
      base_w.z() = yaw_rate + motion.gyro_bias_rad_s + motion.gyro_noise_rad_s * gyro.normal();
      sources.imu.push_back({.stamp = stamp_at(kEpoch_s + t + motion.gyro_late_s),
                             .angular_velocity_rad_s = motion.gyro_from_base * base_w});
    }
    if (i % 10 == 0) {
      SE2::Tangent step = (last.inverse() * truth).log();
      const double root = std::sqrt(step.head<2>().norm());
      step.x() = wheel_scale * step.x() + 0.003 * motion.wheel_noise * root * wheels.normal();
      step.z() = wheel_yaw_scale * step.z() + 0.005 * motion.wheel_noise * root * wheels.normal();
      step.head<2>() *= motion.measured_distance;
      step.z() *= motion.measured_turn;
      odom = odom * SE2::exp(step);
      sources.odometry.push_back(
          {.stamp = stamp_at(kEpoch_s + t + motion.odometry_late_s), .odom_T_base = odom});
      last = truth;
    }
    if (i % 500 == 0 && motion.tags) {
      constexpr double kSigma_m = 0.008;
      constexpr double kSigma_rad = 0.008;
      const double noise = motion.observed_noise;
      Eigen::Vector3d error(noise * kSigma_m * tags.normal(), 0, 0);
      error.y() = noise * kSigma_m * tags.normal();
      error.z() = noise * kSigma_rad * tags.normal();
      const SE2 seen(motion.observed_distance * truth.x() + error.x(),
                     motion.observed_distance * truth.y() + error.y(), truth.yaw() + error.z());
      const SensorTime stamp = stamp_at(kEpoch_s + t + motion.observed_late_s);
      if (fix)
        sources.observed.push_back({.from = stamp - std::chrono::seconds(1),
                                    .to = stamp,
                                    .twist = (fix->inverse() * seen).log(),
                                    .sigma_m = 1.5 * kSigma_m,
                                    .sigma_rad = 1.5 * kSigma_rad});
      fix = seen;
    }
    truth = truth * SE2::exp({kStep_s * course.speed(t), 0, kStep_s * yaw_rate});
  }
  return sources;
}

}  // namespace waymark::test

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/runtime/commission_trace.hpp"
#include "waymark/samples/robot_model.hpp"

namespace waymark {

/// What a reading is measured in, which says in which other units it may have been sent.
enum class ReadingUnit : std::uint8_t { Length, Angle };

/// One measurement of a steady motion, by one key of the robot's messages.
struct MotionReading {
  std::string key{};     ///< odometry.speed_m_s
  std::string origin{};  ///< what measured it: odometry, wheels, imu, tags; one origin may have several keys
  ReadingUnit unit = ReadingUnit::Length;
  double measured = 0;  ///< [m/s] or [rad/s] as it was sent
  double ratio = 0;     ///< to what was commanded
};

/// All that measured how fast the robot went forward, of the steady part of a straight motion. What has fewer
/// than two samples is not among them.
[[nodiscard]] std::vector<MotionReading> forward_readings(const MotionTrace& steady, const RobotModel& model);
/// All that measured how fast it turned. `standing`: the part in which it stood, for the bias of the gyro.
[[nodiscard]] std::vector<MotionReading> turn_readings(const MotionTrace& steady, const MotionTrace& standing,
                                                       const RobotModel& model);

/// Mean angular velocity while moving less that while standing [rad/s]; nothing without samples.
[[nodiscard]] std::optional<Eigen::Vector3d> rotation_by_gyro(const MotionTrace& steady,
                                                              const MotionTrace& standing);
/// Mean rates of the wheels of the left and right side [rad/s]; nothing without samples.
[[nodiscard]] std::optional<Eigen::Vector2d> wheel_rates(const MotionTrace& steady);

/// A straight way by the odometry.
struct OdometryLeg {
  double yaw_rad = 0;                                 ///< of the robot in odom, in the middle of the way
  Eigen::Vector2d moved_m = Eigen::Vector2d::Zero();  ///< in odom
};
[[nodiscard]] std::optional<OdometryLeg> odometry_leg(const MotionTrace& steady);

}  // namespace waymark

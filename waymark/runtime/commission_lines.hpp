#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/runtime/commission_motion.hpp"
#include "waymark/samples/robot_model.hpp"

/// Verdicts of a first drive (`waymark commission`): pure functions of commands and measurements.
namespace waymark {

/// Dimension of a reading, which determines in which other units it may have been sent.
enum class ReadingUnit : std::uint8_t { Length, Angle };

/// One measurement of a steady motion, by one key of the robot's messages.
struct MotionReading {
  std::string key{};     ///< odometry.speed_m_s
  std::string origin{};  ///< source: odometry, wheels, imu, tags; one source may have several keys
  ReadingUnit unit = ReadingUnit::Length;
  double measured = 0;  ///< [m/s] or [rad/s], as sent
  double ratio = 0;     ///< measured over commanded
};

/// Readings of the forward speed during the steady part of a straight motion. Sources with fewer than two
/// samples are omitted.
[[nodiscard]] std::vector<MotionReading> forward_readings(const MotionTrace& steady, const RobotModel& model);
/// Readings of the yaw rate. `standing`: the part at standstill, for the bias of the gyro.
[[nodiscard]] std::vector<MotionReading> turn_readings(const MotionTrace& steady, const MotionTrace& standing,
                                                       const RobotModel& model);

/// Mean angular velocity while moving minus that at standstill [rad/s]; none without samples.
[[nodiscard]] std::optional<Eigen::Vector3d> rotation_by_gyro(const MotionTrace& steady,
                                                              const MotionTrace& standing);
/// Mean rates of the left and right wheels [rad/s]; none without samples.
[[nodiscard]] std::optional<Eigen::Vector2d> wheel_rates(const MotionTrace& steady);

/// A straight motion by odometry.
struct OdometryLeg {
  double yaw_rad = 0;  ///< heading of the robot in odom, in the middle of the motion
  Eigen::Vector2d moved_m = Eigen::Vector2d::Zero();  ///< in odom
};
[[nodiscard]] std::optional<OdometryLeg> odometry_leg(const MotionTrace& steady);

enum class CommissionVerdict : std::uint8_t { Ok, Warn, Fail };
/// "ok", "warn", "fail".
[[nodiscard]] const char* to_string(CommissionVerdict verdict);

struct CommissionLine {
  std::string key{};  ///< stable key of the check: command.speed_m_s, odometry.yaw_rad, stop.kill
  CommissionVerdict verdict = CommissionVerdict::Ok;
  std::string message{};
  std::string remedy{};  ///< the key or program to correct; empty if the check passed
};

/// Whether a motion looked right to a person; none if no person was asked.
using Seen = std::optional<bool>;

/// Whether the wheels touch the floor.
enum class Ground : std::uint8_t { Lifted, Floor };

/// Evaluates a straight motion: sign, unit and size of every reading, swapped axes, a reversed wheel, and the
/// command itself if all readings agree on another motion. With lifted wheels, tags and gyro are ignored.
[[nodiscard]] std::vector<CommissionLine> judge_forward(const MotionTrace& trace, const RobotModel& model,
                                                        Ground ground, Seen seen = {});
/// Evaluates a turn to the left on the spot in the same way. With lifted wheels, odometry that does not turn
/// is only a warning, because it may take its heading from a gyro.
[[nodiscard]] std::vector<CommissionLine> judge_turn(const MotionTrace& trace, const RobotModel& model,
                                                     Ground ground, Seen seen = {});
/// Checks whether the position moved along yaw, forwards or backwards, in each straight motion; reports
/// reversed or swapped axes. Two motions at right angles distinguish all cases. Empty without odometry.
[[nodiscard]] std::vector<CommissionLine> judge_axes(const std::vector<OdometryLeg>& legs);
/// Evaluates the accelerometer at standstill: 9.81 m/s2 along z. Empty without an IMU.
[[nodiscard]] std::vector<CommissionLine> judge_standing(const MotionTrace& standing);

/// Response and stopping of a robot for one motion, by its odometry.
struct MotionTiming {
  std::optional<double> response_s{};  ///< from the command to half the speed
  std::optional<double> stopping_s{};  ///< from the end of the commands to standstill; none: did not stop
  double stopping_m = 0;               ///< distance driven meanwhile
  double watched_s = 0;                ///< observation time after the end
};
[[nodiscard]] MotionTiming timing_of(const MotionTrace& trace);
/// Evaluates a stop. `key` identifies it; `allowed_s` is the time until zero reaches the robot (e.g. from a
/// watchdog); it is added to the allowed stopping time.
[[nodiscard]] CommissionLine judge_stop(const std::string& key, const MotionTiming& timing, double allowed_s);
[[nodiscard]] CommissionLine judge_response(const MotionTiming& timing);

/// Whether no line has the verdict Fail.
[[nodiscard]] bool all_pass(const std::vector<CommissionLine>& lines);

}  // namespace waymark

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/runtime/commission_motion.hpp"
#include "waymark/samples/robot_model.hpp"

/// Verdicts for a first drive (`waymark commission`), as pure functions of commands and measurements.
namespace waymark {

/// Dimension of a reading, which determines the wrong units in which it may have been sent.
enum class ReadingUnit : std::uint8_t { Length, Angle };

/// One measurement of a steady motion, from one key in the robot's messages.
struct MotionReading {
  std::string key{};     ///< name of the key: odometry.speed_m_s
  std::string origin{};  ///< source: odometry, wheels, imu or tags; one source may have several keys
  ReadingUnit unit = ReadingUnit::Length;
  double measured = 0;  ///< value in [m/s] or [rad/s], as sent
  double ratio = 0;     ///< ratio of measured to commanded motion
};

/// Readings of the forward speed during the steady part of a straight motion. Sources with fewer than two
/// samples are omitted.
[[nodiscard]] std::vector<MotionReading> forward_readings(const MotionTrace& steady, const RobotModel& model);
/// Readings of the yaw rate. `standing` is the part at standstill, which is used to estimate the bias of the
/// gyro.
[[nodiscard]] std::vector<MotionReading> turn_readings(const MotionTrace& steady, const MotionTrace& standing,
                                                       const RobotModel& model);

/// Mean angular velocity while moving minus that at standstill [rad/s]; `nullopt` without samples.
[[nodiscard]] std::optional<Eigen::Vector3d> rotation_by_gyro(const MotionTrace& steady,
                                                              const MotionTrace& standing);
/// Mean rates of the left and right wheels [rad/s]; `nullopt` without samples.
[[nodiscard]] std::optional<Eigen::Vector2d> wheel_rates(const MotionTrace& steady);

/// A straight motion as measured by odometry.
struct OdometryLeg {
  double yaw_rad = 0;  ///< heading of the robot in the odom frame, halfway through the motion
  Eigen::Vector2d moved_m = Eigen::Vector2d::Zero();  ///< displacement in the odom frame
};
[[nodiscard]] std::optional<OdometryLeg> odometry_leg(const MotionTrace& steady);

enum class CommissionVerdict : std::uint8_t { Ok, Warn, Fail };
/// Returns "ok", "warn" or "fail".
[[nodiscard]] const char* to_string(CommissionVerdict verdict);

struct CommissionLine {
  std::string key{};  ///< stable key of the check, such as command.speed_m_s, odometry.yaw_rad or stop.kill
  CommissionVerdict verdict = CommissionVerdict::Ok;
  std::string message{};
  std::string remedy{};  ///< the key or the program to be corrected; empty if the check passed
};

/// Whether a motion looked right to a person; `nullopt` if no person was asked.
using Seen = std::optional<bool>;

/// Whether the wheels touch the floor.
enum class Ground : std::uint8_t { Lifted, Floor };

/// Evaluates a straight motion: the sign, unit and size of every reading, swapped axes, a reversed wheel, and
/// the command itself if all readings agree on a different motion. With lifted wheels, tags and the gyro are
/// ignored.
[[nodiscard]] std::vector<CommissionLine> judge_forward(const MotionTrace& trace, const RobotModel& model,
                                                        Ground ground, Seen seen = {});
/// Evaluates a turn to the left on the spot in the same way. With lifted wheels, a constant heading in the
/// odometry causes only a warning, because the heading may come from a gyro.
[[nodiscard]] std::vector<CommissionLine> judge_turn(const MotionTrace& trace, const RobotModel& model,
                                                     Ground ground, Seen seen = {});
/// Checks whether the position moved along yaw, forwards or backwards, in each straight motion, and reports
/// reversed or swapped axes. Two perpendicular motions are enough to distinguish all cases. Empty without
/// odometry.
[[nodiscard]] std::vector<CommissionLine> judge_axes(const std::vector<OdometryLeg>& legs);
/// Evaluates the accelerometer at standstill, where it should measure 9.81 m/s2 along z. Empty without an
/// IMU.
[[nodiscard]] std::vector<CommissionLine> judge_standing(const MotionTrace& standing);

/// How a robot responded to one motion command and how it stopped, measured with its odometry.
struct MotionTiming {
  std::optional<double> response_s{};  ///< time from the command until half the speed was reached
  std::optional<double> stopping_s{};  ///< time from the end of the commands until standstill; `nullopt` if
                                       ///< the robot did not stop
  double stopping_m = 0;               ///< distance driven during this time
  double watched_s = 0;                ///< how long the robot was observed after the end of the commands
};
[[nodiscard]] MotionTiming timing_of(const MotionTrace& trace);
/// Evaluates a stop. `key` identifies it. `allowed_s` is the time until zero reaches the robot (for example
/// from a watchdog) and is added to the maximum stopping time.
[[nodiscard]] CommissionLine judge_stop(const std::string& key, const MotionTiming& timing, double allowed_s);
[[nodiscard]] CommissionLine judge_response(const MotionTiming& timing);

/// Whether no line has the verdict Fail.
[[nodiscard]] bool all_pass(const std::vector<CommissionLine>& lines);

}  // namespace waymark

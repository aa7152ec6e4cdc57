#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/runtime/commission_motion.hpp"
#include "waymark/samples/robot_model.hpp"

/// The verdicts of a first drive (`waymark commission`): pure functions of what was commanded and measured.
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

enum class CommissionVerdict : std::uint8_t { Ok, Warn, Fail };
/// "ok", "warn", "fail".
[[nodiscard]] const char* to_string(CommissionVerdict verdict);

struct CommissionLine {
  std::string key{};  ///< what was checked: a stable word, command.speed_m_s, odometry.yaw_rad, stop.kill
  CommissionVerdict verdict = CommissionVerdict::Ok;
  std::string words{};
  std::string mend{};  ///< the key or the program that mends it; empty where all is well
};

/// Whether a motion looked right to a person who watched; nothing where nobody said.
using Seen = std::optional<bool>;

/// Where the wheels are.
enum class Ground : std::uint8_t { Lifted, Floor };

/// A straight motion: sign, unit and size of every reading, the command itself where all readings agree that
/// it did something else, axes that are swapped, a wheel that is reversed. Lifted, tags and gyro do not
/// count.
[[nodiscard]] std::vector<CommissionLine> judge_forward(const MotionTrace& trace, const RobotModel& model,
                                                        Ground ground, Seen seen = {});
/// A turn to the left on the spot, likewise. Lifted, an odometry that does not turn may take its turning from
/// a gyro: a warning.
[[nodiscard]] std::vector<CommissionLine> judge_turn(const MotionTrace& trace, const RobotModel& model,
                                                     Ground ground, Seen seen = {});
/// Whether the position moved along yaw, forward or back, in each of some straight motions; names the axes
/// that are reversed or swapped. Two ways at right angles tell all of them apart. Nothing without odometry.
[[nodiscard]] std::vector<CommissionLine> judge_axes(const std::vector<OdometryLeg>& legs);
/// The accelerometer of a robot that stands: 9.81 m/s2 along z. Nothing without an IMU.
[[nodiscard]] std::vector<CommissionLine> judge_standing(const MotionTrace& standing);

/// How a robot took up a motion and ended it, by its odometry.
struct MotionTiming {
  std::optional<double> response_s{};  ///< from the command to half the speed
  std::optional<double>
      stopping_s{};       ///< from the end of the commands to standing; nothing: it did not stand
  double stopping_m = 0;  ///< way meanwhile
  double watched_s = 0;   ///< how long it was watched after the end
};
[[nodiscard]] MotionTiming timing_of(const MotionTrace& trace);
/// A stop: `key` says which; `allowed_s` is the time until zero reaches the robot (of a watchdog), added to
/// what a robot may take.
[[nodiscard]] CommissionLine judge_stop(const std::string& key, const MotionTiming& timing, double allowed_s);
[[nodiscard]] CommissionLine judge_response(const MotionTiming& timing);

/// Whether nothing failed.
[[nodiscard]] bool all_pass(const std::vector<CommissionLine>& lines);

}  // namespace waymark

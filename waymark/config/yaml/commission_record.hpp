#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot_model.hpp"

namespace waymark {

/// Results of a first drive (`waymark commission`), stored in a robot's file under `commissioned`. Values
/// that were not measured are empty.
struct CommissionFigures {
  std::optional<double> response_s{};          ///< time from a command until half the speed is reached
  std::optional<double> stopping_s{};          ///< time from the zero command to standstill, at 0.1 m/s
  std::optional<double> stopping_m{};          ///< distance travelled until standstill
  std::optional<double> silence_stopping_s{};  ///< time from the last command to standstill
  std::optional<double> kill_stopping_s{};     ///< time from the end of the driving process to standstill
  std::optional<double> speed_scale{};         ///< actual speed divided by commanded speed
  std::optional<double> yaw_rate_scale{};      ///< actual yaw rate divided by commanded yaw rate
};

struct CommissionRecord {
  bool passed = false;
  std::string date{};                 ///< such as 2026-11-23
  std::string version{};              ///< Waymark's version
  std::string robot{};                ///< value of the argument `robot` of the drive
  std::string topics{};               ///< digest of the robot's topic profile; empty if it has none
  MotionLimits limits{};              ///< at the time of the drive
  double wheel_radius_m = 0;          ///< at the time of the drive
  double track_m = 0;                 ///< at the time of the drive
  std::vector<std::string> failed{};  ///< keys of the checks that failed
  CommissionFigures figures{};
};

/// Conditions of a first drive that are not part of the robot's file.
struct CommissionGround {
  std::string robot{};   ///< value of the argument `robot`
  std::string topics{};  ///< digest_of() the robot's topic profile; empty if there is none
};

/// The record in a robot's file; `nullopt` if the file has none. Errors contain file, line and key.
[[nodiscard]] Result<std::optional<CommissionRecord>> parse_commission(std::string_view text,
                                                                       const std::string& source);
/// The text of a robot's file with its record replaced by this one; everything else is unchanged. Fails if
/// the result does not read back.
[[nodiscard]] Result<std::string> with_commission(std::string_view text, const CommissionRecord& record);

/// Reasons why a record is not valid for this robot: each key that has changed since the drive, as text.
/// Empty if the record is valid. `passed` is not checked.
[[nodiscard]] std::vector<std::string> changes_since(const CommissionRecord& record, const RobotModel& model,
                                                     const CommissionGround& ground);

/// fnv1a() as 16 hexadecimal digits; empty for an empty text.
[[nodiscard]] std::string digest_of(std::string_view text);

}  // namespace waymark

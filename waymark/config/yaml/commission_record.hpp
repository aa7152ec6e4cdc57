#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot_model.hpp"

namespace waymark {

/// What a first drive (`waymark commission`) found, as it stands in a robot's file under `commissioned`. What
/// was not measured is nothing.
struct CommissionFigures {
  std::optional<double> response_s{};          ///< from a command to half the speed
  std::optional<double> stopping_s{};          ///< from zero to standing, at 0.1 m/s
  std::optional<double> stopping_m{};          ///< way meanwhile
  std::optional<double> silence_stopping_s{};  ///< from the last command to standing
  std::optional<double> kill_stopping_s{};     ///< from the end of the driving process to standing
  std::optional<double> speed_scale{};         ///< speed over what was commanded
  std::optional<double> yaw_rate_scale{};      ///< yaw rate over what was commanded
};

struct CommissionRecord {
  bool passed = false;
  std::string date{};                 ///< 2026-11-23
  std::string version{};              ///< of Waymark
  std::string robot{};                ///< the word `robot` of the drive
  std::string topics{};               ///< digest of what maps its topics; empty: it has none
  MotionLimits limits{};              ///< as they were then
  double wheel_radius_m = 0;          ///< as it was then
  double track_m = 0;                 ///< as it was then
  std::vector<std::string> failed{};  ///< keys of the checks that failed
  CommissionFigures figures{};
};

/// What a commission rests on besides the robot's file.
struct CommissionGround {
  std::string robot{};   ///< the word `robot`
  std::string topics{};  ///< digest_of() what maps the robot's topics; empty: none
};

/// The record of a robot's file; nothing where there is none. Errors have file, line and key.
[[nodiscard]] Result<std::optional<CommissionRecord>> parse_commission(std::string_view text,
                                                                       const std::string& source);
/// The text of a robot's file with this record in place of the one it had; all else stays as it is written.
/// Fails where the text does not read back.
[[nodiscard]] Result<std::string> with_commission(std::string_view text, const CommissionRecord& record);

/// Why a record does not count for this robot: each key that has changed since, in words; empty where it
/// counts. `passed` is not looked at.
[[nodiscard]] std::vector<std::string> changes_since(const CommissionRecord& record, const RobotModel& model,
                                                     const CommissionGround& ground);

/// FNV-1a of 64 bits (Fowler, Noll, Vo) as 16 hexadecimal digits; empty of an empty text. Tells texts apart,
/// and is no protection against anybody.
[[nodiscard]] std::string digest_of(std::string_view text);

}  // namespace waymark

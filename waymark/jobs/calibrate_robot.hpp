#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/jobs/localize_log.hpp"
#include "waymark/localization/innovation_calibration.hpp"
#include "waymark/mapping/lap/lap_calibration.hpp"

/// `waymark calibrate robot`: where the camera sits, scales, gains and latency from a drive past tags.
namespace waymark {

enum class CalibrateRobotBy : std::uint8_t {
  Either,       ///< the lap, where it holds what that takes
  Lap,          ///< tags, way and numbers together, by bundle adjustment
  Innovations,  ///< the numbers with which a filter predicts best what was seen; needs a map
};

struct CalibrateRobotJob {
  LocalizeJob drive{};  ///< recordings, map, robot, earlier calibration, filter; `output`: calibration.yaml
  CalibrateRobotBy by = CalibrateRobotBy::Either;
  double from_s = 0;  ///< of the drive, after its first sample
  double to_s = std::numeric_limits<double>::infinity();
};

struct CalibrateRobotReport {
  Calibration calibration{};
  std::optional<LapCalibration> lap{};         ///< when it was found by the lap
  std::optional<InnovationFit> innovations{};  ///< when it was found by innovations
  std::vector<std::string> warnings{};
};

/// Fails before anything is read when the output cannot be written.
[[nodiscard]] Result<CalibrateRobotReport> calibrate_robot(const CalibrateRobotJob& job,
                                                           const JobControl& control);
/// Writes what was found to the job's output, if it names one; what stood there moves aside, and its new name
/// is given back. Fails, and writes nothing, where the drive
/// told no number, or no better ones than were given.
[[nodiscard]] Result<std::string> write_robot_calibration(const CalibrateRobotJob& job,
                                                          const CalibrateRobotReport& report);
[[nodiscard]] nlohmann::ordered_json to_json(const CalibrateRobotReport& report);

}  // namespace waymark

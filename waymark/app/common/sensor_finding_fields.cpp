#include "waymark/app/common/sensor_finding_fields.hpp"

#include <array>
#include <cstddef>
#include <string>

namespace waymark {
namespace {

std::string measure_name(SensorMeasure measure) {
  constexpr std::array kNames{"none", "corrected", "gyro_not_used"};
  return kNames[static_cast<std::size_t>(measure)];
}

std::string source_name(SensorKind source) {
  constexpr std::array kNames{"gyro", "odometry", "observations"};
  return kNames[static_cast<std::size_t>(source)];
}

}  // namespace

bool is_odometry_scale(const SensorFinding& finding) {
  const SensorFault fault = finding.found.likely.front().fault;
  return fault == SensorFault::OdometryYawScale || fault == SensorFault::OdometryDistanceScale;
}

ReportFields fields(const SensorExplanation& explanation) {
  const Eigen::Vector3d& up = explanation.gyro_up;
  return {{"fault", "Stable name of the fault, such as gyro_unit", std::string(to_string(explanation.fault))},
          {"source", "gyro, odometry or observations", source_name(source_of(explanation.fault))},
          {"value",
           "Units: measured over true value; scales: true over measured value; times: stamp minus true time "
           "[s]; otherwise 1",
           explanation.value},
          {"sigma", "Standard deviation of the value", explanation.sigma},
          {"log_odds", "Natural logarithm of the odds of this fault against sensors without a fault",
           explanation.log_odds},
          {"gyro_up", "Upward axis of the base, in the axes of the gyro: x, y, z",
           std::array{up.x(), up.y(), up.z()}}};
}

ReportFields fields(const SensorFinding& finding) {
  const SensorExplanations& found = finding.found;
  ReportFields all = fields(found.likely.empty() ? SensorExplanation{} : found.likely.front());
  all.push_back({"rival", "Most likely fault of another source; null if there is none", found.rival});
  all.push_back({"decided", "Whether the fault is at least 20 times as likely as the rival", found.decided});
  all.push_back({"intervals", "Number of intervals in which the sources were compared", found.intervals});
  all.push_back({"measure", "none, corrected or gyro_not_used", measure_name(finding.measure)});
  all.push_back({"message", "Message for the user", describe(finding)});
  return all;
}

}  // namespace waymark

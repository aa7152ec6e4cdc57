#include "waymark/cli/robot_calibration_report.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/config/calibration_file.hpp"

namespace waymark::cli {

std::string values_text(const Calibration& calibration) {
  std::string text;
  for (const std::string& name : calibration_names()) {
    const auto found = calibration.values.find(name);
    if (found == calibration.values.end()) continue;
    const CalibratedValue& v = found->second;
    text += v.verdict == CalibrationVerdict::Known
                ? fmt::format("{:<25}{:>12.5f} +- {:.5f}{}{}\n", name, v.value, v.sigma,
                              v.advice.empty() ? "" : "    ", v.advice)
                : fmt::format("{:<25}{:>12}    {}\n", name, "unobservable", v.advice);
  }
  return text;
}

nlohmann::ordered_json values_json(const Calibration& calibration) {
  nlohmann::ordered_json json;
  for (const std::string& name : calibration_names()) {
    const auto found = calibration.values.find(name);
    if (found == calibration.values.end()) continue;
    const CalibratedValue& v = found->second;
    json["values"][name] = {{"value", v.value},
                            {"sigma", v.sigma},
                            {"verdict", v.verdict == CalibrationVerdict::Known ? "known" : "unobservable"},
                            {"advice", v.advice}};
  }
  return json;
}

bool tells_nothing(const Calibration& calibration) {
  return std::ranges::none_of(calibration.values, [](const auto& entry) {
    return entry.second.verdict == CalibrationVerdict::Known;
  });
}

}  // namespace waymark::cli

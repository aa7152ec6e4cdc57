#include "waymark/app/calibrate_robot/calibrate_robot_text.hpp"

#include <fmt/format.h>

#include "waymark/config/calibration_file.hpp"

namespace waymark {

std::string to_text(const CalibrateRobotReport& report) {
  std::string text;
  for (const std::string& name : calibration_names()) {
    const auto found = report.calibration.values.find(name);
    if (found == report.calibration.values.end()) continue;
    const CalibratedValue& v = found->second;
    text += v.verdict == CalibrationVerdict::Known
                ? fmt::format("{:<25}{:>12.5f} +- {:.5f}{}{}\n", name, v.value, v.sigma,
                              v.advice.empty() ? "" : "    ", v.advice)
                : fmt::format("{:<25}{:>12}    {}\n", name, "unobservable", v.advice);
  }
  if (report.lap)
    text += fmt::format("found together with the places of {} tags; corners within {:.2f} px (rms)\n",
                        report.lap->map.map.tags.size(), report.lap->map.rms_px);
  if (const auto& fit = report.innovations)
    text += fmt::format(
        "NIS per degree of freedom: {:.3f} before, {:.3f} after; of the third of the drive that was held "
        "out: {:.3f} before, {:.3f} after\n",
        fit->cost_before, fit->cost_after, fit->held_out_before, fit->held_out_after);
  return text;
}

}  // namespace waymark

#include "waymark/app/localize/localize_text.hpp"

#include <fmt/format.h>

#include "waymark/base/angles.hpp"

namespace waymark {

std::string to_text(const LocalizeReport& report) {
  if (report.estimates == 0) return fmt::format("no estimate over {:.1f} s\n", report.duration_s);
  std::string text =
      fmt::format("{} estimates over {:.1f} s, {:.1f} % of them certain", report.estimates, report.duration_s,
                  100.0 * static_cast<double>(report.certain) / static_cast<double>(report.estimates));
  text += report.first_fix_s ? fmt::format(", the first after {:.2f} s\n", *report.first_fix_s) : "\n";
  if (report.compared > 0)
    text += fmt::format("{} of {} observations accepted, NIS {:.2f} per degree of freedom\n", report.accepted,
                        report.compared, report.nis_mean);
  if (report.last && report.certain > 0)
    text += fmt::format("last: x {:.3f} m, y {:.3f} m, heading {:.1f} deg, within {:.3f} m (one sigma)\n",
                        report.last->map_T_base.x(), report.last->map_T_base.y(),
                        to_degrees(report.last->map_T_base.yaw()), report.last->position_sigma_m());
  if (report.lasting_nis)
    text += fmt::format(
        "means of 30 observations of one tag: NIS {:.2f} (1 when lasting errors are known to last)\n",
        *report.lasting_nis);
  return text;
}

std::vector<std::string> doubts_about(const LocalizeReport& report) {
  std::vector<std::string> doubts;
  if (report.certain == 0) doubts.emplace_back("never knew where it is");
  if (report.lasting_nis.value_or(0) > 4)
    doubts.emplace_back(
        "see --sensor-pose, `waymark calibrate robot`, --tag-sigma-m and --mounting-sigma-rad: what is known "
        "about "
        "the robot and the map, and how well");
  if (report.compared > 0 && 10 * report.accepted < report.compared)
    doubts.emplace_back(
        "warning: hardly any observation agrees with the map: is it the map of this place, and the camera of "
        "this "
        "robot "
        "(--robot, --calibration)?");
  return doubts;
}

}  // namespace waymark

#include "waymark/app/evaluate/trajectory_text.hpp"

#include <fmt/format.h>

namespace waymark {
namespace {

std::string metres(const std::optional<double>& value) { return value ? fmt::format("{:.4f}", *value) : "-"; }

std::string row_text(const TrajectoryRow& row) {
  const auto& s = row.scores;
  const auto& p = row.path;
  const auto of = [](const auto& scores, auto&& member) {
    return scores ? std::optional<double>(member(*scores)) : std::nullopt;
  };
  return fmt::format("{:<20}{:>7}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}\n", row.name, row.poses.size(),
                     metres(of(s, [](const auto& x) { return x.ate_m.rmse; })),
                     metres(of(s, [](const auto& x) { return x.ate_m.max; })),
                     s ? fmt::format("{:.3f}", s->heading_deg.rmse) : "-",
                     metres(of(s, [](const auto& x) { return x.relative.translation_m.rmse; })),
                     metres(of(p, [](const auto& x) { return x.distance_m.rmse; })),
                     metres(of(p, [](const auto& x) { return x.distance_m.max; })),
                     p && p->side_m.count > 0 ? fmt::format("{:.4f}", p->side_m.rmse) : "-");
}

std::string doubt_text(const Consistency& c) {
  if (c.count == 0) return "consistency: no covariance of the estimate is positive definite\n";
  const char* verdict = c.nees_mean > 4.5   ? "overconfident"
                        : c.nees_mean < 2.0 ? "conservative"
                                            : "consistent";
  return fmt::format(
      "consistency: NEES {:.2f} on average ({} should be 3), {:.1f} % within 95 % ellipsoids: {}{}\n",
      c.nees_mean, "x, y, yaw:", 100 * c.inside_95, verdict,
      c.refused > 0 ? fmt::format("; {} covariances are none", c.refused) : "");
}

std::string nis_text(const NisSummary& nis) {
  const char* verdict =
      nis.mean > 1.5   ? "observations are less consistent than assumed: calibrate, or assume more noise"
      : nis.mean < 0.5 ? "observations are more consistent than assumed: assume less noise"
                       : "consistent (which does not test errors that all observations share, "
                         "such as a displaced map)";
  return fmt::format("observations: NIS {:.2f} per degree of freedom of {} (should be 1), {} rejected: {}\n",
                     nis.mean, nis.observations, nis.rejected, verdict);
}

}  // namespace

std::string to_text(const TrajectoryReport& report) {
  std::string text = fmt::format("{:<20}{:>7}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "", "poses",
                                 "ATE m", "max m", "yaw deg", "RPE m", "path m", "max m", "side m");
  for (const TrajectoryRow& row : report.rows) text += row_text(row);
  const TrajectoryRow& estimate = report.rows.front();
  if (estimate.scores)
    text += fmt::format("ATE, yaw, path, side: root mean square; alignment {}{}; RPE over {}\n",
                        to_string(report.alignment),
                        report.alignment == AlignmentKind::Sim3
                            ? fmt::format(", scale {:.5f}", estimate.scores->alignment.scale)
                            : "",
                        report.options.rpe_delta_m > 0 ? fmt::format("{} m", report.options.rpe_delta_m)
                                                       : fmt::format("{} s", report.options.rpe_delta_s));
  if (estimate.scores && estimate.scores->consistency) text += doubt_text(*estimate.scores->consistency);
  if (report.nis) text += nis_text(*report.nis);
  if (report.uncertain > 0)
    text += fmt::format("not judged: {} estimates that were called uncertain\n", report.uncertain);
  if (estimate.jumps) text += fmt::format("jumps: {}\n", *estimate.jumps);
  if (report.coverage) text += fmt::format("cover: {:.1f} % of the time\n", 100 * *report.coverage);
  if (report.time_to_first_fix_s)
    text += fmt::format("first fix: after {:.2f} s\n", *report.time_to_first_fix_s);
  text += fmt::format("end: {:.3f} m and {:.1f} deg from where it began\n", end_to_start_m(estimate.poses),
                      end_to_start_deg(estimate.poses));
  return text;
}

}  // namespace waymark

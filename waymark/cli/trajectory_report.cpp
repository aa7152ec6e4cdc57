#include "waymark/cli/trajectory_report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/base/angles.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark::cli {
namespace {

using Json = nlohmann::ordered_json;

double seconds_of(const EstimatedTrajectory& poses) {
  return poses.empty() ? 0 : to_seconds(poses.back().stamp - poses.front().stamp);
}

/// From the first pose to the last, for a robot that came back to where it began.
double end_to_start_m(const EstimatedTrajectory& poses) {
  return (poses.back().map_T_base.translation() - poses.front().map_T_base.translation()).norm();
}

double end_to_start_deg(const EstimatedTrajectory& poses) {
  const SE3 start_T_end = poses.front().map_T_base.inverse() * poses.back().map_T_base;
  return to_degrees(project_to_plane(start_T_end).yaw());
}

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
  if (c.count == 0) return "doubt: no covariance of the estimate is one (positive definite)\n";
  const char* verdict = c.nees_mean > 4.5   ? "too sure of itself"
                        : c.nees_mean < 2.0 ? "doubts more than it errs"
                                            : "honest";
  return fmt::format(
      "doubt: NEES {:.2f} on average ({} should be 3), {:.1f} % within 95 % ellipsoids: {}{}\n", c.nees_mean,
      "x, y, yaw:", 100 * c.inside_95, verdict,
      c.refused > 0 ? fmt::format("; {} covariances are none", c.refused) : "");
}

std::string nis_text(const NisSummary& nis) {
  const char* verdict = nis.mean > 1.5 ? "what it sees agrees worse than it expects: calibrate, or doubt more"
                        : nis.mean < 0.5 ? "expects worse than it sees"
                                         : "they agree as well as it expects (which says nothing of what all "
                                           "sightings share, such as a map that is off)";
  return fmt::format("sightings: NIS {:.2f} per degree of freedom of {} (should be 1), {} not believed: {}\n",
                     nis.mean, nis.sightings, nis.not_believed, verdict);
}

Json statistics_json(const std::string& name, const std::string& unit,
                     const std::optional<ErrorStatistics>& statistics) {
  Json json;
  const auto put = [&](const char* what, double ErrorStatistics::*member) {
    const std::string key = fmt::format("{}_{}_{}", name, what, unit);
    json[key] = statistics ? Json((*statistics).*member) : Json(nullptr);
  };
  put("rmse", &ErrorStatistics::rmse);
  put("mean", &ErrorStatistics::mean);
  put("median", &ErrorStatistics::median);
  put("p95", &ErrorStatistics::p95);
  put("max", &ErrorStatistics::max);
  return json;
}

template <class Scores, class Member>
std::optional<ErrorStatistics> part(const std::optional<Scores>& scores, Member&& member) {
  return scores ? std::optional(member(*scores)) : std::nullopt;
}

Json row_json(const TrajectoryRow& row, const TrajectoryReport& report) {
  const auto& s = row.scores;
  Json json = {{"name", row.name},
               {"poses", row.poses.size()},
               {"paired", row.pairs},
               {"duration_s", seconds_of(row.poses)},
               {"scale", s ? Json(s->alignment.scale) : Json(nullptr)}};
  json.update(statistics_json("ate", "m", part(s, [](const auto& x) { return x.ate_m; })));
  json.update(statistics_json("rotation", "deg", part(s, [](const auto& x) { return x.rotation_deg; })));
  json.update(statistics_json("heading", "deg", part(s, [](const auto& x) { return x.heading_deg; })));
  const bool by_metres = report.options.rpe_delta_m > 0;
  json[by_metres ? "rpe_delta_m" : "rpe_delta_s"] =
      by_metres ? report.options.rpe_delta_m : report.options.rpe_delta_s;
  json.update(statistics_json("rpe", "m", part(s, [](const auto& x) { return x.relative.translation_m; })));
  json.update(statistics_json("rpe", "deg", part(s, [](const auto& x) { return x.relative.rotation_deg; })));
  json["end_error_m"] = s ? Json(s->end_error_m) : Json(nullptr);
  json.update(statistics_json("path", "m", part(row.path, [](const auto& x) { return x.distance_m; })));
  const bool sides = row.path && row.path->side_m.count > 0;
  json["side_rmse_m"] = sides ? Json(row.path->side_m.rmse) : Json(nullptr);
  json["side_mean_m"] = sides ? Json(row.path->side_mean_m) : Json(nullptr);
  json["end_to_start_m"] = end_to_start_m(row.poses);
  json["end_to_start_deg"] = end_to_start_deg(row.poses);
  const bool doubts = s && s->consistency && s->consistency->count > 0;
  json["nees_mean"] = doubts ? Json(s->consistency->nees_mean) : Json(nullptr);
  json["nees_median"] = doubts ? Json(s->consistency->nees_median) : Json(nullptr);
  json["inside_95"] = doubts ? Json(s->consistency->inside_95) : Json(nullptr);
  json["jumps"] = row.jumps ? Json(*row.jumps) : Json(nullptr);
  return json;
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

Json to_json(const TrajectoryReport& report) {
  Json json = {{"estimate", report.estimate},
               {"reference", report.reference},
               {"alignment", to_string(report.alignment)}};
  json.update(row_json(report.rows.front(), report));
  json["nis_mean"] = report.nis && report.nis->sightings > 0 ? Json(report.nis->mean) : Json(nullptr);
  json["sightings"] = report.nis ? Json(report.nis->sightings) : Json(nullptr);
  json["uncertain"] = report.uncertain;
  json["coverage"] = report.coverage ? Json(*report.coverage) : Json(nullptr);
  json["time_to_first_fix_s"] =
      report.time_to_first_fix_s ? Json(*report.time_to_first_fix_s) : Json(nullptr);
  json["beside"] = Json::array();
  for (std::size_t i = 1; i < report.rows.size(); ++i)
    json["beside"].push_back(row_json(report.rows[i], report));
  return json;
}

}  // namespace waymark::cli

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/evaluate/evaluate_trajectory.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

using Json = nlohmann::ordered_json;

double seconds_of(const EstimatedTrajectory& poses) {
  return poses.empty() ? 0 : to_seconds(poses.back().stamp - poses.front().stamp);
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

double end_to_start_m(const EstimatedTrajectory& poses) {
  if (poses.empty()) return 0;
  return (poses.back().map_T_base.translation() - poses.front().map_T_base.translation()).norm();
}

double end_to_start_deg(const EstimatedTrajectory& poses) {
  if (poses.empty()) return 0;
  const SE3 start_T_end = poses.front().map_T_base.inverse() * poses.back().map_T_base;
  return to_degrees(project_to_plane(start_T_end).yaw());
}

Json to_json(const TrajectoryReport& report) {
  Json json = {{"estimate", report.estimate},
               {"reference", report.reference},
               {"alignment", to_string(report.alignment)}};
  json.update(row_json(report.rows.front(), report));
  json["nis_mean"] = report.nis && report.nis->observations > 0 ? Json(report.nis->mean) : Json(nullptr);
  json["observations"] = report.nis ? Json(report.nis->observations) : Json(nullptr);
  json["uncertain"] = report.uncertain;
  json["coverage"] = report.coverage ? Json(*report.coverage) : Json(nullptr);
  json["time_to_first_fix_s"] =
      report.time_to_first_fix_s ? Json(*report.time_to_first_fix_s) : Json(nullptr);
  json["beside"] = Json::array();
  for (std::size_t i = 1; i < report.rows.size(); ++i)
    json["beside"].push_back(row_json(report.rows[i], report));
  return json;
}

}  // namespace waymark

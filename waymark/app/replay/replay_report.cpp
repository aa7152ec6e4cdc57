#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/replay/replay_route.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

/// "stopped 2 m along a route: a stick was moved", but "stopped by the operator 2 m along a route".
std::string stopped_where(const std::string& where, const std::string& reason) {
  constexpr std::string_view kState = "stopped: ";
  if (reason.starts_with("stopped ")) return reason + " " + where;
  return fmt::format("stopped {}: {}", where,
                     reason.starts_with(kState) ? reason.substr(kState.size()) : reason);
}

}  // namespace

std::string with_reason(std::string_view state, std::string_view reason) {
  if (reason.empty()) return std::string(state);
  if (reason.starts_with(state)) return std::string(reason);
  return fmt::format("{}: {}", state, reason);
}

std::string ending(const ReplayReport& report, std::string_view stopped_by) {
  const ReplayEnd& end = report.end;
  const double driven_m =
      std::round(100 * report.end.driven_m) / 100 + 0.0;  // a robot that swayed: no "-0.00"
  const std::string where =
      fmt::format("{:.2f} m along a route of {:.2f} m", driven_m, report.route_length_m);
  if (end.finished) return "the route was driven to its end";
  if (end.interrupted) return fmt::format("stopped by {} {}: the robot stands", stopped_by, where);
  if (end.state == ReplayState::Refused) return "refused to start: " + end.reason;
  if (end.state == ReplayState::Waiting && end.frames == 0)
    return "never knew where it is: nothing was heard of a camera. Does the robot send pictures or tags? One "
           "of this computer is named with --camera-source";
  if (end.state == ReplayState::Waiting)
    return end.frames_with_two_tags > 0 ? "never knew where it is: the tags that were seen contradict the "
                                          "map. Is it the map of this place?"
                                        : "never knew where it is: no two tags of the map were seen at once";
  if (!end.reason.empty()) return stopped_where(where, end.reason);
  return fmt::format("not at the end of its way after {:.0f} s of simulated time: given up {}",
                     report.allowed_s, where);
}

namespace {

/// Sightings, not tags: a tag that is covered for a second at 20 Hz counts 20 times.
std::string missed_words(const ReplayEnd& end) {
  int all = 0;
  for (const auto& [reason, count] : end.missed_tags) all += count;
  if (all == 0) return {};
  return fmt::format("tags that should have been in a picture and were not found: {} ({})", all,
                     counted_reasons(end.missed_tags));
}

nlohmann::ordered_json missed_json(const ReplayEnd& end) {
  constexpr std::array<std::pair<MissReason, const char*>, 4> kKeys = {{{MissReason::Outside, "outside"},
                                                                        {MissReason::TooFaint, "too_faint"},
                                                                        {MissReason::Blurred, "blurred"},
                                                                        {MissReason::Occluded, "occluded"}}};
  nlohmann::ordered_json missed;
  for (const auto& [reason, key] : kKeys) {
    const auto found = end.missed_tags.find(reason);
    missed[key] = found == end.missed_tags.end() ? 0 : found->second;
  }
  return missed;
}

}  // namespace

std::string to_text(const ReplayReport& report, std::string_view stopped_by) {
  const ReplayEnd& end = report.end;
  std::string text =
      fmt::format("{}; {:.1f} s, {}\n", ending(report, stopped_by), end.lap_s, counted(end.stops, "stop"));
  for (const StationVisit& visit : report.visits)
    text += fmt::format("stood at '{}', {:.2f} m along the route, for {:.1f} s\n", visit.name,
                        visit.arc_length_m, visit.stood_s);
  if (end.frames > 0)
    text += fmt::format("two or more tags in view {:.1f} % of the time\n",
                        100.0 * end.frames_with_two_tags / end.frames);
  if (const std::string missed = missed_words(end); !missed.empty()) text += missed + "\n";
  if (!report.judgement) return text;
  const ReplayJudgement& j = *report.judgement;
  return text + fmt::format(
                    "by the truth: {} completed, {:.2f} m driven\n"
                    "  from the route       {:.3f} m rmse, {:.3f} m 95 %, {:.3f} m worst\n"
                    "  heading              {:.2f} deg rmse\n"
                    "  nearest to a tag     {:.3f} m from the hull\n",
                    counted(j.laps_completed, "lap"), j.distance_m, j.cross_track_rmse_m, j.cross_track_p95_m,
                    j.cross_track_max_m, j.heading_rmse_deg, j.min_clearance_m);
}

bool succeeded(const ReplayReport& report) { return report.end.finished; }

namespace {

nlohmann::ordered_json visits_json(const ReplayReport& report) {
  auto visits = nlohmann::ordered_json::array();
  for (const StationVisit& visit : report.visits)
    visits.push_back({{"name", visit.name},
                      {"arc_length_m", visit.arc_length_m},
                      {"arrived_s", to_seconds(visit.arrived.time_since_epoch())},
                      {"stood_s", visit.stood_s}});
  return visits;
}

}  // namespace

nlohmann::ordered_json to_json(const ReplayReport& report) {
  const ReplayEnd& end = report.end;
  const auto judged = [&](auto member) -> nlohmann::ordered_json {
    if (!report.judgement) return nullptr;
    return (*report.judgement).*member;
  };
  const double two_tags = end.frames > 0 ? static_cast<double>(end.frames_with_two_tags) / end.frames : 0.0;
  return {{"laps_completed", judged(&ReplayJudgement::laps_completed)},
          {"finished", end.finished},
          {"reason", end.reason},
          {"cross_track_rmse_m", judged(&ReplayJudgement::cross_track_rmse_m)},
          {"cross_track_p95_m", judged(&ReplayJudgement::cross_track_p95_m)},
          {"cross_track_max_m", judged(&ReplayJudgement::cross_track_max_m)},
          {"heading_rmse_deg", judged(&ReplayJudgement::heading_rmse_deg)},
          {"min_clearance_m", judged(&ReplayJudgement::min_clearance_m)},
          {"two_tags_fraction", two_tags},
          {"missed_tags", missed_json(end)},
          {"stops", end.stops},
          {"distance_m", judged(&ReplayJudgement::distance_m)},
          {"lap_s", end.lap_s},
          {"stations", visits_json(report)},
          {"wall_s", report.wall_s},
          {"warnings", report.warnings}};
}

}  // namespace waymark

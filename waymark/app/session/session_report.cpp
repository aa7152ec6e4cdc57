#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/session/run_session.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {

bool succeeded(const SessionReport& report) {
  return !report.map_failed &&
         std::ranges::all_of(report.replays, [](const ReplayReport& replay) { return succeeded(replay); });
}

std::string to_text(const SessionReport& report, std::string_view stopped_by) {
  std::string text = fmt::format("{} taught, {}\n", counted(report.laps_taught, "lap"),
                                 counted(report.replays.size(), "replay"));
  for (const ReplayReport& replay : report.replays) {
    text += ending(replay, stopped_by);
    if (replay.judgement)
      text += fmt::format("; by the truth {:.3f} m rmse from the taught way, {:.3f} m worst",
                          replay.judgement->cross_track_rmse_m, replay.judgement->cross_track_max_m);
    text += '\n';
  }
  return text;
}

nlohmann::ordered_json to_json(const SessionReport& report) {
  auto replays = nlohmann::ordered_json::array();
  for (const ReplayReport& replay : report.replays) replays.push_back(to_json(replay));
  return {{"laps_taught", report.laps_taught}, {"mapping_s", report.mapping_s},
          {"replays", std::move(replays)},     {"state", report.state},
          {"reason", report.reason},           {"wall_s", report.wall_s}};
}

}  // namespace waymark

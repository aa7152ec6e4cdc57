#include "waymark/jobs/experiment_summary.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

/// Of an even number of values the mean of the two in the middle.
double middle_of(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t n = values.size();
  return n == 0 ? 0 : (values[(n - 1) / 2] + values[n / 2]) / 2;
}

nlohmann::ordered_json summary_of(const std::string& cell, const std::vector<const ExperimentRun*>& runs) {
  std::vector<double> rmse;
  std::vector<double> largest;
  int finished = 0;
  std::vector<std::string> endings;
  for (const ExperimentRun* run : runs) {
    finished += run->finished ? 1 : 0;
    if (!run->finished) endings.push_back(fmt::format("seed {}: {}", run->seed, run->ending));
    if (!run->judged) continue;
    rmse.push_back(run->judged->cross_track_rmse_m);
    largest.push_back(run->judged->cross_track_max_m);
  }
  const auto middle = [](const std::vector<double>& v) {
    return v.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(middle_of(v));
  };
  const auto worst = [](const std::vector<double>& v) {
    return v.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(*std::ranges::max_element(v));
  };
  return {{"what", cell},
          {"runs", runs.size()},
          {"completed", finished},
          {"cross_track_rmse_median_m", middle(rmse)},
          {"cross_track_rmse_worst_m", worst(rmse)},
          {"cross_track_max_median_m", middle(largest)},
          {"cross_track_max_worst_m", worst(largest)},
          {"endings", endings}};
}

}  // namespace

nlohmann::ordered_json summaries_of(const std::vector<ExperimentRun>& runs) {
  std::vector<std::string> order;
  std::map<std::string, std::vector<const ExperimentRun*>> cells;
  for (const ExperimentRun& run : runs) {
    if (cells[run.cell].empty()) order.push_back(run.cell);
    cells[run.cell].push_back(&run);
  }
  nlohmann::ordered_json summaries = nlohmann::ordered_json::array();
  for (const std::string& cell : order) summaries.push_back(summary_of(cell, cells[cell]));
  return summaries;
}

std::string experiment_table(const nlohmann::ordered_json& cells) {
  std::string text = fmt::format("{:<52}{:>6}{:>11}{:>22}{:>22}\n", "", "runs", "completed",
                                 "rmse median/worst [m]", "max median/worst [m]");
  for (const auto& cell : cells) {
    const auto metres = [&](const char* key) {  // nothing to judge is no zero
      return cell[key].is_null() ? std::string("-") : fmt::format("{:.4f}", cell[key].get<double>());
    };
    text += fmt::format("{:<52}{:>6}{:>11}{:>14} /{:>6}{:>14} /{:>6}\n", cell["what"].get<std::string>(),
                        cell["runs"].get<int>(), cell["completed"].get<int>(),
                        metres("cross_track_rmse_median_m"), metres("cross_track_rmse_worst_m"),
                        metres("cross_track_max_median_m"), metres("cross_track_max_worst_m"));
    for (const auto& words : cell["endings"]) text += "    " + words.get<std::string>() + "\n";
  }
  return text;
}

}  // namespace waymark

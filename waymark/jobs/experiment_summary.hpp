#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/evaluation/replay_judgement.hpp"

/// What `waymark experiment` found, over the seeds of each combination.
namespace waymark {

/// One replay.
struct ExperimentRun {
  std::string cell{};  ///< everything but the seed, in words
  std::uint64_t seed = 0;
  bool finished = false;
  std::string ending{};
  std::optional<ReplayJudgement> judged{};
};

/// A list with an object a cell, in the order of the runs: runs, completed, median and worst cross-track
/// error, and how those ended that were not completed.
[[nodiscard]] nlohmann::ordered_json summaries_of(const std::vector<ExperimentRun>& runs);

/// The same as a table, a row a cell.
[[nodiscard]] std::string experiment_table(const nlohmann::ordered_json& summaries);

}  // namespace waymark

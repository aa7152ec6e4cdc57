#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/cli/trajectory_files.hpp"
#include "waymark/evaluation/path_scores.hpp"
#include "waymark/evaluation/trajectory_scores.hpp"

namespace waymark::cli {

/// What there is to say about one trajectory.
struct TrajectoryRow {
  std::string name{};  ///< "estimate", "odometry", "odometry with gyro"
  EstimatedTrajectory poses{};
  std::optional<TrajectoryScores> scores{};  ///< nothing without a reference that has times
  std::optional<PathScores> path{};
  std::size_t pairs = 0;               ///< poses at a time the reference knows
  std::optional<std::size_t> jumps{};  ///< against the reference, else against odometry
};

struct TrajectoryReport {
  std::string estimate{};   ///< file
  std::string reference{};  ///< file
  AlignmentKind alignment = AlignmentKind::None;
  TrajectoryScoreOptions options{};
  std::vector<TrajectoryRow> rows{};  ///< the estimate first
  std::optional<double> coverage{};
  std::optional<NisSummary> nis{};
  std::size_t uncertain = 0;  ///< mere guesses, which are not judged
  std::optional<double> time_to_first_fix_s{};
};

/// A table: a row a trajectory, then words about doubt, jumps and cover.
[[nodiscard]] std::string to_text(const TrajectoryReport& report);

/// The contract of `waymark evaluate --json` (docs/reference/cli.md). What is not known is null.
[[nodiscard]] nlohmann::ordered_json to_json(const TrajectoryReport& report);

}  // namespace waymark::cli

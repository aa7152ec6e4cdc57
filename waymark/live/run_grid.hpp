#pragma once

#include <filesystem>
#include <vector>

#include "waymark/jobs/experiment_summary.hpp"
#include "waymark/jobs/job_control.hpp"
#include "waymark/live/experiment_grid.hpp"

namespace waymark {

/// Teaches, maps and replays everything the grid combines, in folders lap-1, lap-2, … of the folder.
/// Cancelling ends it with what was driven until then.
[[nodiscard]] Result<std::vector<ExperimentRun>> run_grid(const ExperimentGrid& grid,
                                                          const std::filesystem::path& folder,
                                                          const JobControl& control);

}  // namespace waymark

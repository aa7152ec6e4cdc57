#pragma once

#include <filesystem>
#include <vector>

#include "waymark/cli/console.hpp"
#include "waymark/cli/experiment_grid.hpp"
#include "waymark/jobs/experiment_summary.hpp"

namespace waymark::cli {

/// Teaches, maps and replays everything the grid combines, in folders lap-1, lap-2, … of the folder. Ctrl-C
/// ends it with what was driven until then.
[[nodiscard]] Result<std::vector<ExperimentRun>> run_grid(const ExperimentGrid& grid,
                                                          const std::filesystem::path& folder,
                                                          Console& console);

}  // namespace waymark::cli

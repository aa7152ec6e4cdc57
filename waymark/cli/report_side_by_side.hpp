#pragma once

#include "waymark/cli/report_run.hpp"

namespace waymark::cli {

/// Each drive in a row, by what needs no truth: how simulation and reality differ.
[[nodiscard]] plot::PageTable side_by_side(const Runs& runs);

}  // namespace waymark::cli

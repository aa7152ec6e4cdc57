#pragma once

#include "waymark/app/evaluate/report_page.hpp"

namespace waymark {

/// Each drive in a row, by what needs no truth: how simulation and reality differ.
[[nodiscard]] plot::PageTable side_by_side(const Runs& runs);
/// Rates, gaps, latencies and noises of each drive in a column, measured alike; no rows where fewer than two
/// drives could be measured.
[[nodiscard]] plot::PageTable sensors_side_by_side(const Runs& runs);

}  // namespace waymark

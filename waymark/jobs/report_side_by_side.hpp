#pragma once

#include "waymark/jobs/report_page.hpp"

namespace waymark {

/// Each drive in a row, by what needs no truth: how simulation and reality differ.
[[nodiscard]] plot::PageTable side_by_side(const Runs& runs);

}  // namespace waymark

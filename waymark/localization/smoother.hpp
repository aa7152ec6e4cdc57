#pragma once

#include <span>
#include <vector>

#include "waymark/localization/tracker.hpp"

namespace waymark {

/// What the run looks like in hindsight: Rauch, Tung and Striebel ("Maximum Likelihood Estimates of Linear
/// Dynamic Systems", AIAA Journal 3(8), 1965) on the invariant error, (18). One estimate for each step, in
/// order. Chains (a new start, a jump) are smoothed one by one. Errors that stay (of tags, of the mounting)
/// count as they do in the filter. O(steps).
[[nodiscard]] std::vector<LocalizationEstimate> smooth(std::span<const TraceStep> trace);

/// The pose a while ago, by all that was seen since: the first of the smoothed steps no older than `lag`.
/// Nothing while the run is shorter. O(steps in the lag), no allocation.
[[nodiscard]] std::optional<LocalizationEstimate> smoothed_before(std::span<const TraceStep> trace,
                                                                  Duration lag);

}  // namespace waymark

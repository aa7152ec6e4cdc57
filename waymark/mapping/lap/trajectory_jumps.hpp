#pragma once

#include "waymark/mapping/lap/bundle_map.hpp"

namespace waymark::internal {

/// A tag that was moved can pull the way apart between its two places: wheels are trusted little, so that a
/// jump of the robot costs less than many observations. Where the way jumps and the wheels did not, the
/// search is tried again without one of the tags that contradict most, with wheels as exact as most of them
/// are, and then as before with all; what explains everything better stays. `summary` is of the search that
/// ended where the bundle is.
void mend_jumps_of_the_way(const LapInput& input, const BundleMapOptions& options,
                           const BundleOptions& search, const BundleProgress& progress, LapBundle& lap,
                           BundleSummary& summary);

}  // namespace waymark::internal

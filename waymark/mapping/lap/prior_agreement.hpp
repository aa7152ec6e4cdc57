#pragma once

#include "waymark/mapping/lap/prior_terms.hpp"

/// Which tags of a lap stand where the map that is there has them.
namespace waymark::internal {

/// Whether each of its tags was measured by itself: a map that was made from laps has an anchor that is known
/// exactly, and ties.
[[nodiscard]] bool is_measured(const TagMap& map);

/// Whether a tag of the prior map does not move.
[[nodiscard]] bool is_held(const LapPrior& prior, const TagId& tag, const MappedTag& mapped);

[[nodiscard]] bool stands_where_it_was(const MapComparison& comparison, const TagId& tag);

/// The tags whose places in the lap by itself and in the prior map are one place; the others were moved, or
/// swapped. `now` has the tags that the lap saw. Of a map from laps, as far as the two know: both are off by
/// what is wrong with the tags' print, and stand on one anchor. Of a measured map, roughly, as the two are
/// aligned: how the anchor is printed tilts the lap that stands on it; `revise_agreement` asks again.
void find_agreeing(const LapPrior& prior, const TagMap& now, const LapBundle& lap, const TagId& anchor,
                   const BundleCovariance& known, TiedPrior& tied);

/// Asks anew once the bundle is solved that is tied to a map that was measured. What is beside tied tags is
/// where it was, so that tags taken for moved may agree now: they are tied as well. Where none does, the tag
/// is untied, for good, that is farthest from where the lap and all other tags have it (the residual without
/// its own datum: Cook and Weisberg, "Residuals and Influence in Regression", 1982, section 2.2), if farther
/// than both can be wrong by. False where nothing changed; else the bundle is to be solved again, at most
/// twice for each tag. TiedPrior::words say how far tags are by where the poses are when it is called.
[[nodiscard]] bool revise_agreement(const LapPrior& prior, LapBundle& lap, TiedPrior& tied);

}  // namespace waymark::internal

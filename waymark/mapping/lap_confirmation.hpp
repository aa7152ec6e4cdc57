#pragma once

#include <vector>

#include "waymark/mapping/lap_bundle.hpp"
#include "waymark/mapping/wheel_sites.hpp"

/// Which sightings of a lap are confirmed by others, before anything is placed.
namespace waymark::internal {

/// Sightings that neither a neighbour in the picture nor the wheels confirm (confirm_sightings), in order:
/// where wheels are recorded, also those of a tag alone in its picture. `observed`: the frames of the lap,
/// one by one.
[[nodiscard]] std::vector<SightingIndex> unconfirmed_sightings(const LapInput& lap,
                                                               const std::vector<ObservedFrame>& observed);

}  // namespace waymark::internal

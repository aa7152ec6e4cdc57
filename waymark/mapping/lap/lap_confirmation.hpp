#pragma once

#include <vector>

#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/mapping/lap/wheel_sites.hpp"

/// Which observations of a lap are confirmed by others, before anything is placed.
namespace waymark::internal {

/// Observations that neither a neighbour in the picture nor the wheels confirm (confirm_observations), in
/// order: where wheels are recorded, also those of a tag alone in its picture. `observed`: the frames of the
/// lap, one by one.
[[nodiscard]] std::vector<ObservationIndex> unconfirmed_observations(
    const LapInput& lap, const std::vector<ObservedFrame>& observed);

}  // namespace waymark::internal

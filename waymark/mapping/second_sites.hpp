#pragma once

#include <cstddef>
#include <vector>

#include "waymark/mapping/lap_bundle.hpp"
#include "waymark/mapping/teach_chain.hpp"

namespace waymark::internal {

/// A detection of a lap: its frame, and its place there.
struct SightingIndex {
  std::size_t frame = 0;
  std::size_t detection = 0;
};

/// Sightings of an id that the wheels alone put so far from where most of its sightings are that two tags
/// must carry it. Before anything is placed by them: a frame that takes one tag for the other is lost, and
/// with it all it shows. Wheels that put tags which were passed twice in two places as often as in one are
/// not believed. Empty without odometry. `observed`: the frames, one by one. O(sightings).
[[nodiscard]] std::vector<SightingIndex> sightings_of_second_sites(
    const LapInput& lap, const std::vector<ObservedFrame>& observed);
/// The lap without them.
[[nodiscard]] LapInput without(const LapInput& lap, const std::vector<SightingIndex>& sightings);

}  // namespace waymark::internal

#pragma once

#include <cstddef>
#include <vector>

#include "waymark/mapping/lap/wheel_sites.hpp"

namespace waymark::internal {

/// Observations of an id that the wheels alone put elsewhere than most of its observations: two tags carry
/// it, or it was moved in front of the camera. Before anything is placed by them: a frame that takes one
/// place for the other is lost, and with it all it shows.
///
/// - Seen by turns in two places, there are two tags: wheels have no say in that.
/// - From one frame to the next in another place, it was moved, unless most of what was in view jumped too.
/// - In another place after some way, it is as the wheels say, unless they put tags which were passed twice
/// in
///   two places as often as in one.
///
/// Empty without odometry. `observed`: the frames, one by one. O(observations).
[[nodiscard]] std::vector<ObservationIndex> observations_of_duplicate_tags(
    const LapInput& lap, const std::vector<ObservedFrame>& observed);
/// The lap without them.
[[nodiscard]] LapInput without(const LapInput& lap, const std::vector<ObservationIndex>& observations);

}  // namespace waymark::internal

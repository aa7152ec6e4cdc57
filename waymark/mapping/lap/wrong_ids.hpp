#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "waymark/mapping/lap/chain.hpp"
#include "waymark/mapping/lap/lap_bundle.hpp"

/// Ids that two tags carry, that were moved or misread, before anything is placed: by where the wheels alone
/// put what was seen, and by what other observations confirm.
namespace waymark::internal {

/// A detection of a lap: its frame, and its place there.
struct ObservationIndex {
  std::size_t frame = 0;
  std::size_t detection = 0;
  auto operator<=>(const ObservationIndex&) const = default;
};

/// An observation, placed by the wheels.
struct WheelObservation {
  ObservationIndex index{};
  Eigen::Vector2d odom_p = Eigen::Vector2d::Zero();
  double distance_m = 0;  ///< of the tag from the camera
  double driven_m = 0;    ///< by then
  double turned_rad = 0;  ///< by then, to either side
};

/// Observations of an id that the wheels put in one place, in order of time.
struct WheelSite {
  std::vector<WheelObservation> seen{};
  bool passed_twice = false;  ///< it was found there again after some metres
};

/// The sites of each id: a tag is followed from observation to observation; where it was lost, it is found
/// again at the nearest site that the wheels can have drifted from since; a site whose observations jump from
/// one frame to the next is two. Observations that nothing follows, as of ids that were misread, have no
/// site. Empty without odometry. `observed`: the frames of the lap, one by one. O(observations * sites of a
/// tag).
[[nodiscard]] std::map<TagId, std::vector<WheelSite>> wheel_sites(const LapInput& lap,
                                                                  const std::vector<ObservedFrame>& observed);

/// Observations of an id that the wheels alone put elsewhere than most of its observations: two tags carry
/// it, or it was moved in front of the camera. Before anything is placed by them: a frame that takes one
/// place for the other is lost, and with it all it shows.
///
/// - Seen by turns in two places, there are two tags: wheels have no say in that.
/// - From one frame to the next in another place, it was moved, unless most of what was in view jumped too.
/// - In another place after some way, it is as the wheels say, unless they put tags which were passed twice
///   in two places as often as in one.
///
/// Empty without odometry. `observed`: the frames, one by one. O(observations).
[[nodiscard]] std::vector<ObservationIndex> observations_of_duplicate_tags(
    const LapInput& lap, const std::vector<ObservedFrame>& observed);
/// The lap without them.
[[nodiscard]] LapInput without(const LapInput& lap, const std::vector<ObservationIndex>& observations);

/// Observations that neither a neighbour in the picture nor the wheels confirm (confirm_observations), in
/// order: where wheels are recorded, also those of a tag alone in its picture. `observed`: the frames of the
/// lap, one by one.
[[nodiscard]] std::vector<ObservationIndex> unconfirmed_observations(
    const LapInput& lap, const std::vector<ObservedFrame>& observed);

}  // namespace waymark::internal

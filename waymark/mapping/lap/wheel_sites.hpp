#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/mapping/lap/teach_chain.hpp"

/// Where the wheels alone put what was seen.
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

}  // namespace waymark::internal

#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "waymark/mapping/lap_bundle.hpp"
#include "waymark/mapping/teach_chain.hpp"

/// Where the wheels alone put what was seen.
namespace waymark::internal {

/// A detection of a lap: its frame, and its place there.
struct SightingIndex {
  std::size_t frame = 0;
  std::size_t detection = 0;
  auto operator<=>(const SightingIndex&) const = default;
};

/// A sighting, placed by the wheels.
struct WheelSighting {
  SightingIndex index{};
  Eigen::Vector2d odom_p = Eigen::Vector2d::Zero();
  double distance_m = 0;  ///< of the tag from the camera
  double driven_m = 0;    ///< by then
  double turned_rad = 0;  ///< by then, to either side
};

/// Sightings of an id that the wheels put in one place, in order of time.
struct WheelSite {
  std::vector<WheelSighting> seen{};
  bool passed_twice = false;  ///< it was found there again after some metres
};

/// The sites of each id: a tag is followed from sighting to sighting; where it was lost, it is found again at
/// the nearest site that the wheels can have drifted from since; a site whose sightings jump from one frame
/// to the next is two. Sightings that nothing follows, as of ids that were misread, have no site. Empty
/// without odometry. `observed`: the frames of the lap, one by one. O(sightings * sites of a tag).
[[nodiscard]] std::map<TagId, std::vector<WheelSite>> wheel_sites(const LapInput& lap,
                                                                  const std::vector<ObservedFrame>& observed);

}  // namespace waymark::internal

#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "waymark/mapping/lap/chain.hpp"
#include "waymark/mapping/lap/lap_bundle.hpp"

/// Finds duplicate, moved or misread ids before anything is placed. Uses the positions of observations
/// according to odometry alone, and confirmation by other observations.
namespace waymark::internal {

/// A detection of a lap: its frame, and its index in the frame.
struct ObservationIndex {
  std::size_t frame = 0;
  std::size_t detection = 0;
  auto operator<=>(const ObservationIndex&) const = default;
};

/// An observation with its position according to odometry.
struct WheelObservation {
  ObservationIndex index{};
  Eigen::Vector2d odom_p = Eigen::Vector2d::Zero();
  double distance_m = 0;  ///< of the tag from the camera
  double driven_m = 0;    ///< at that time
  double turned_rad = 0;  ///< at that time, sum over both directions
};

/// Observations of an id at one place according to odometry, in order of time.
struct WheelSite {
  std::vector<WheelObservation> seen{};
  bool passed_twice = false;  ///< it was observed there again after some metres
};

/// The sites of each id. A tag is followed from observation to observation. After a gap it is assigned to the
/// nearest site within the possible odometry drift since. A site whose observations jump between frames is
/// split in two. Isolated observations, such as of misread ids, have no site. Empty without odometry.
/// `observed`: the frames of the lap, in order. O(observations * sites per tag).
[[nodiscard]] std::map<TagId, std::vector<WheelSite>> wheel_sites(const LapInput& lap,
                                                                  const std::vector<ObservedFrame>& observed);

/// Observations of an id that are, according to odometry alone, at another place than most of its
/// observations. Either two tags have this id, or the tag was moved in view of the camera. The observations
/// must be excluded before anything is placed, because a frame that confuses the two places is lost with all
/// its observations.
///
/// - If the id alternates between two places, there are two tags, regardless of odometry.
/// - If it changes place from one frame to the next, it was moved, unless most tags in view jumped too.
/// - If it is at another place later, odometry decides, unless odometry gives two places for tags passed
/// twice as often as it gives one.
///
/// Empty without odometry. `observed`: the frames, in order. O(observations).
[[nodiscard]] std::vector<ObservationIndex> observations_of_duplicate_tags(
    const LapInput& lap, const std::vector<ObservedFrame>& observed);
/// The lap without these observations.
[[nodiscard]] LapInput without(const LapInput& lap, const std::vector<ObservationIndex>& observations);

/// Observations, in order, that neither a neighbour in the image nor odometry confirms
/// (confirm_observations()). With odometry, these include observations of a tag alone in its image.
/// `observed`: the frames of the lap, in order.
[[nodiscard]] std::vector<ObservationIndex> unconfirmed_observations(
    const LapInput& lap, const std::vector<ObservedFrame>& observed);

}  // namespace waymark::internal

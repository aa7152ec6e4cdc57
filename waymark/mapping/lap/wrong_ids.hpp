#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "waymark/mapping/lap/chain.hpp"
#include "waymark/mapping/lap/lap_bundle.hpp"

/// Finds duplicate, moved or misread ids before anything is placed. The decision is based on the positions of
/// observations according to odometry alone, and on confirmation by other observations.
namespace waymark::internal {

/// A detection in a lap, given by its frame and its index in the frame.
struct ObservationIndex {
  std::size_t frame = 0;
  std::size_t detection = 0;
  auto operator<=>(const ObservationIndex&) const = default;
};

/// An observation with its position according to odometry.
struct WheelObservation {
  ObservationIndex index{};
  Eigen::Vector2d odom_p = Eigen::Vector2d::Zero();
  double distance_m = 0;  ///< distance of the tag from the camera
  double driven_m = 0;    ///< distance driven up to that time
  double turned_rad = 0;  ///< rotation up to that time, with turns in both directions counted as positive
};

/// Observations of an id in one place according to odometry, in chronological order.
struct WheelSite {
  std::vector<WheelObservation> seen{};
  bool passed_twice = false;  ///< whether the tag was observed there again after some metres
};

/// The sites of each id. A tag is followed from observation to observation. After a gap, it is assigned to
/// the nearest site that is within the possible odometry drift since then. A site whose observations jump
/// between frames is split there. Isolated observations, such as those of misread ids, have no site. Empty
/// without odometry. `observed`: the frames of the lap, in order. O(observations * sites per tag).
[[nodiscard]] std::map<TagId, std::vector<WheelSite>> wheel_sites(const LapInput& lap,
                                                                  const std::vector<ObservedFrame>& observed);

/// Observations of an id that are elsewhere than the tag that the map shows, according to odometry alone.
/// Either two tags have this id, or the tag was moved in view of the camera. The observations must be
/// excluded before anything is placed, because a frame that confuses the two places is lost with all its
/// observations.
///
/// - If the id alternates between two places, there are two tags, whatever odometry indicates. The place with
///   the most observations remains.
/// - If it changes its place from one frame to the next, the tag was moved, unless more tags jumped at this
///   time than were stationary. A tag is stationary if an error of odometry would have displaced it
///   significantly more. The last place of the moved tag remains, however often it was moved. For the anchor,
///   the first one remains, because LapInput::map_T_anchor applies to it. If that place has only a few
///   observations, they may be poor ones. The place with the most observations then remains.
/// - If it is in another place later, odometry is decisive, unless it indicates two places for more tags than
///   it finds again in one place. The place with the most observations remains.
///
/// Empty without odometry. `observed`: the frames, in order. O(observations * sites per tag).
[[nodiscard]] std::vector<ObservationIndex> observations_of_duplicate_tags(
    const LapInput& lap, const std::vector<ObservedFrame>& observed);

/// Observations that are removed from a lap until this object is destroyed, which restores them. The frames
/// of a long lap need most of the memory, so they are not copied. The lap must outlive this object, and its
/// frames must not change in the meantime.
class ExcludedObservations {
 public:
  /// `observations`: in ascending order.
  ExcludedObservations(LapInput& lap, const std::vector<ObservationIndex>& observations);
  ~ExcludedObservations();
  ExcludedObservations(const ExcludedObservations&) = delete;
  ExcludedObservations& operator=(const ExcludedObservations&) = delete;

 private:
  struct Excluded {
    ObservationIndex index{};
    TagDetection detection;
  };

  LapInput& lap_;
  std::vector<Excluded> excluded_{};  ///< in descending order
};

/// The observations, in order, that are confirmed neither by a neighbour in the image nor by odometry (see
/// confirm_observations()). With odometry, these can include observations of a tag that is alone in its
/// image. `observed`: the frames of the lap, in order.
[[nodiscard]] std::vector<ObservationIndex> unconfirmed_observations(
    const LapInput& lap, const std::vector<ObservedFrame>& observed);

}  // namespace waymark::internal

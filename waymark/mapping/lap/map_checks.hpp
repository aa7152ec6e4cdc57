#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/mapping/lap/bundle_map.hpp"

namespace waymark {

/// A tag whose observations agree on two poses.
struct SecondPlace {
  TagId tag{};
  SE3 map_T_tag{};        ///< the agreed pose that is not in the map
  double distance_m = 0;  ///< distance between the two poses
  int here = 0;           ///< number of observations that agree with the map
  int there = 0;          ///< number of observations that agree with the second pose
  bool at_once = false;   ///< both poses occur in one frame, so two tags have this id
  /// All observations in one place are earlier than those in the other, because the tag was moved.
  bool one_after_the_other = false;
  /// The tag was pushed or remounted nearby, and the map has its last place. False for the anchor, because
  /// its given pose applies to the time before the move.
  bool is_before_move = false;
  /// If one after the other, the last observation in the earlier and the first one in the later place, since
  /// the first frame.
  double last_before_s = 0, first_after_s = 0;
};

/// The tags that were observed in two places during a lap, except for BundleMap::moved_tags. A small share of
/// a tag's observations is a place only if these were excluded before the search. O(rejected observations).
[[nodiscard]] std::vector<SecondPlace> second_places(const LapInput& lap, const BundleMap& map);

/// Warnings about a map, one sentence each. They concern tag sizes that are inconsistent with odometry or
/// with each other, ids in two places, tags with few observations, rejected observations, and unconnected
/// tags.
[[nodiscard]] std::vector<std::string> check_map(const LapInput& lap, const BundleMap& map);

/// The reasons why an observation was rejected, with the strongest first.
enum class RejectionReason : std::uint8_t { Elsewhere, OtherPose, Inexact, NoPose };
constexpr std::size_t kRejectionReasons = 4;

/// The number of rejections for each reason.
using RejectionCounts = std::array<int, kRejectionReasons>;

/// The number of rejected observations for each tag and reason. O(rejected observations).
[[nodiscard]] std::map<TagId, RejectionCounts> rejections_by_tag(const LapInput& lap, const BundleMap& map);

/// The name of a reason in reports: elsewhere, other_pose, inexact_corners or no_pose.
[[nodiscard]] const char* to_string(RejectionReason reason);

/// The error of a closed loop before (from odometry alone) and after mapping (in the map).
struct LoopClosure {
  TagId tag{};            ///< the tag that was observed again after it had been out of view for a long time
  double away_s = 0;      ///< time for which it was out of view
  double way_m = 0;       ///< distance driven during this time
  double before_m = 0;    ///< position error of odometry alone over this distance
  double before_rad = 0;  ///< heading error of odometry alone over this distance
  /// Distance in the map between the tag positions from the observations before and after.
  double after_m = 0;
};

/// Computes the loop closure for the mapped tag that was out of view for the longest part of the trajectory.
/// Empty if there is no odometry or if no tag was observed again after ten seconds or more. O(observations).
[[nodiscard]] std::optional<LoopClosure> loop_closure(const LapInput& lap, const BundleMap& map);

/// Parts of check_map().
namespace internal {

/// Of the tags with two places, those that were moved and have their last place in the map. Most of them were
/// moved in view of the camera, so that their observations before the move were excluded from the start.
/// Empty if there are so many second places that they have another cause, which check_map() reports.
[[nodiscard]] std::vector<MovedTag> tags_moved_in_view(const std::vector<SecondPlace>& places,
                                                       const BundleMap& map);

/// Reports how many observations are inconsistent with the others, why, and which tags they belong to.
void check_observations(const LapInput& lap, const BundleMap& map, std::vector<std::string>& warnings);
/// Reports a part of the image in which corners are displaced in one direction, which indicates a wrong
/// calibration.
void check_regions(const BundleMap& map, std::vector<std::string>& warnings);
/// Reports tags that are all on one line, which do not determine positions across it.
void check_line(const BundleMap& map, std::vector<std::string>& warnings);
/// Reports the longest time during which no tag was in view.
void check_blindness(const LapInput& lap, const BundleMap& map, std::vector<std::string>& warnings);
/// Reports a camera mounting that differs from the assumed one.
void check_mounting(const BundleMap& map, std::vector<std::string>& warnings);

}  // namespace internal
}  // namespace waymark

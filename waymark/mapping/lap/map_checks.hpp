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
  SE3 map_T_tag{};        ///< the pose that is not in the map
  double distance_m = 0;  ///< between the two
  int here = 0;           ///< observations that agree with the map
  int there = 0;          ///< observations that agree with the second pose
  bool at_once = false;   ///< both appear in one frame: two tags have this id
  /// All observations of one place are earlier than those of the other, because the tag was moved.
  bool one_after_the_other = false;
};

/// Tags that a lap observed at two places. O(rejected observations).
[[nodiscard]] std::vector<SecondPlace> second_places(const LapInput& lap, const BundleMap& map);

/// Warnings about a map, one sentence each, about tag sizes inconsistent with odometry, ids at two places,
/// tags with few observations, rejected observations, and unconnected tags.
[[nodiscard]] std::vector<std::string> check_map(const LapInput& lap, const BundleMap& map);

/// Why an observation was rejected, the strongest reason first.
enum class RejectionReason : std::uint8_t { Elsewhere, OtherPose, Inexact, NoPose };
constexpr std::size_t kRejectionReasons = 4;

/// Number of rejections for each reason.
using RejectionCounts = std::array<int, kRejectionReasons>;

/// Rejected observations by tag and reason. O(rejected observations).
[[nodiscard]] std::map<TagId, RejectionCounts> rejections_by_tag(const LapInput& lap, const BundleMap& map);

/// Name of a reason in reports: elsewhere, other_pose, inexact_corners, no_pose.
[[nodiscard]] const char* to_string(RejectionReason reason);

/// Error of a closed loop: before (from odometry alone) and after (in the map).
struct LoopClosure {
  TagId tag{};            ///< the tag that was observed again after a long time out of view
  double away_s = 0;      ///< time out of view
  double way_m = 0;       ///< distance driven meanwhile
  double before_m = 0;    ///< position error of odometry alone over it
  double before_rad = 0;  ///< heading error of odometry alone over it
  double after_m = 0;     ///< distance of the tag positions from observations before and after, in the map
};

/// Computes it for the mapped tag that was out of view for the longest part of the trajectory. Empty without
/// odometry, or if no tag was observed again after ten seconds or more. O(observations).
[[nodiscard]] std::optional<LoopClosure> loop_closure(const LapInput& lap, const BundleMap& map);

/// Parts of check_map().
namespace internal {

/// Reports how many observations are inconsistent with the others, why, and of which tags.
void check_observations(const LapInput& lap, const BundleMap& map, std::vector<std::string>& warnings);
/// Reports a part of the image where corners are displaced in one direction, which indicates a wrong
/// calibration.
void check_regions(const BundleMap& map, std::vector<std::string>& warnings);
/// Reports tags on one line, which do not determine positions across it.
void check_line(const BundleMap& map, std::vector<std::string>& warnings);
/// Reports the longest time without a tag.
void check_blindness(const LapInput& lap, const BundleMap& map, std::vector<std::string>& warnings);
/// Reports a camera mounting that differs from the assumed one.
void check_mounting(const BundleMap& map, std::vector<std::string>& warnings);

}  // namespace internal
}  // namespace waymark

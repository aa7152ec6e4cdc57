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

/// A tag whose observations agree on two places.
struct SecondPlace {
  TagId tag{};
  SE3 map_T_tag{};        ///< the place the map does not have
  double distance_m = 0;  ///< between the two
  int here = 0;           ///< observations that agree with the map
  int there = 0;          ///< and with the second place
  bool at_once = false;   ///< both were seen in one frame: two tags carry the id
  bool one_after_the_other =
      false;  ///< all observations of one place come before those of the other: it was moved
};

/// Tags that a lap saw in two places. O(rejected observations).
[[nodiscard]] std::vector<SecondPlace> second_places(const LapInput& lap, const BundleMap& map);

/// What a person should know before trusting the map, one sentence each: tag sizes that contradict the
/// wheels, ids in two places, tags that hang on little, observations left out, tags that lead nowhere.
[[nodiscard]] std::vector<std::string> check_map(const LapInput& lap, const BundleMap& map);

/// Why an observation contradicts the map; what contradicts more comes first.
enum class LeftOutReason : std::uint8_t { Elsewhere, OtherPose, Inexact, NoPose };
constexpr std::size_t kLeftOutReasons = 4;

/// Of each reason, how often.
using LeftOutCounts = std::array<int, kLeftOutReasons>;

/// The observations a map leaves out, by tag and reason. O(observations left out).
[[nodiscard]] std::map<TagId, LeftOutCounts> left_out_by_tag(const LapInput& lap, const BundleMap& map);

/// A word for a reason, as in a summary: elsewhere, other_pose, inexact_corners, no_pose.
[[nodiscard]] const char* to_string(LeftOutReason reason);

/// How well a lap comes back to where it was: before, by the wheels alone; after, by the map.
struct LoopClosure {
  TagId tag{};            ///< seen, out of sight for long, and seen again
  double away_s = 0;      ///< how long it was out of sight
  double way_m = 0;       ///< driven meanwhile
  double before_m = 0;    ///< how far off the wheels alone would be after it
  double before_rad = 0;  ///< and how much their heading
  double after_m = 0;  ///< how far apart its observations before and after put the tag, in the adjusted map
};

/// Of the mapped tag that was out of sight for the longest part of the way. Nothing when no tag was seen
/// again after ten seconds or more, or without odometry. O(observations).
[[nodiscard]] std::optional<LoopClosure> loop_closure(const LapInput& lap, const BundleMap& map);

/// Parts of check_map().
namespace internal {

/// How many observations contradict the others, why, and of which tags.
void check_observations(const LapInput& lap, const BundleMap& map, std::vector<std::string>& words);
/// A part of the picture where corners are off all in one direction: the lens is not the one it is taken for.
void check_regions(const BundleMap& map, std::vector<std::string>& words);
/// Tags on one line: what lies across it is known badly.
void check_line(const BundleMap& map, std::vector<std::string>& words);
/// Times when no tag was seen.
void check_blindness(const LapInput& lap, const BundleMap& map, std::vector<std::string>& words);
/// A camera that sits elsewhere than assumed.
void check_mounting(const BundleMap& map, std::vector<std::string>& words);

}  // namespace internal
}  // namespace waymark

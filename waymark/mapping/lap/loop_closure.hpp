#pragma once

#include <optional>

#include "waymark/mapping/lap/bundle_map.hpp"

namespace waymark {

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

}  // namespace waymark

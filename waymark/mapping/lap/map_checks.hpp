#pragma once

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

}  // namespace waymark

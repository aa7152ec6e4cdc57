#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "waymark/mapping/lap/bundle_map.hpp"

namespace waymark {

/// Why an observation contradicts the map; what contradicts more comes first.
enum class LeftOutReason : std::uint8_t { Elsewhere, OtherPose, Inexact, NoPose };
constexpr std::size_t kLeftOutReasons = 4;

/// Of each reason, how often.
using LeftOutCounts = std::array<int, kLeftOutReasons>;

/// The observations a map leaves out, by tag and reason. O(observations left out).
[[nodiscard]] std::map<TagId, LeftOutCounts> left_out_by_tag(const LapInput& lap, const BundleMap& map);

/// A word for a reason, as in a summary: elsewhere, other_pose, inexact_corners, no_pose.
[[nodiscard]] const char* to_string(LeftOutReason reason);

namespace internal {
/// How many observations contradict the others, why, and of which tags.
void check_observations(const LapInput& lap, const BundleMap& map, std::vector<std::string>& words);
}  // namespace internal

}  // namespace waymark

#pragma once

#include <optional>
#include <vector>

#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// True over commanded yaw rate: regression through the origin of the turns of the trajectory within half a
/// second on the integral of the commands, which act `delay_s` later. Nothing where fewer than 20 such
/// windows were commanded to turn by 2 degrees or more. O(commands + poses).
[[nodiscard]] std::optional<double> turn_response(const std::vector<StampedCommand>& commands,
                                                  const Trajectory& trajectory, double delay_s);

/// Distance below which `share` of the observations of mapped tags lie [m]: of the camera's centre to that of
/// the tag, by map and trajectory. Nothing with fewer than 50 observations. O(n log n).
[[nodiscard]] std::optional<double> observation_distance_m(const std::vector<TagFrame>& frames,
                                                           const TagMap& map, const SE3& base_T_cam,
                                                           const Trajectory& trajectory, double share);

}  // namespace waymark

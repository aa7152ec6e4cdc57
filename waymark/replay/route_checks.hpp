#pragma once

#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/families/family.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/replay/safety_limiter.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/tag_map.hpp"

/// Checks whether a replay can drive a route: it cannot drive sideways, and its limiter stops near tags.
namespace waymark {

/// Largest angle between the heading and the direction of motion of a route that a replay drives [rad]. It
/// exceeds the side slip of a skidding robot.
inline constexpr double kMaxSideways_rad = 20 * std::numbers::pi / 180;

/// For each point, the heading of a robot that follows the route without moving sideways [rad]: along the
/// route or, where it reverses, opposite to it.
[[nodiscard]] std::vector<double> driving_headings(const Route& route);
/// The route with driving_headings() in place of the taught ones. A follower needs these, because it models
/// side slip itself.
[[nodiscard]] Route facing_along(Route route);

/// The part of a route in which the robot did not face its direction of motion.
struct SidewaysMotion {
  std::size_t point = 0;  ///< index of the first such point
  double arc_length_m = 0;
  SE2 map_T_base{};      ///< the pose at this point
  double angle_rad = 0;  ///< heading relative to the direction of motion, where this is largest; positive if
                         ///< the robot faced to the left of it
  double length_m = 0;   ///< length of all such parts
};

/// Where a route moves sideways by more than kMaxSideways_rad. `nullopt` if it does not. At a corner, any
/// heading between the directions before and after it counts as ahead. O(points).
[[nodiscard]] std::optional<SidewaysMotion> sideways_motion(const Route& route);
/// Describes the motion, that a replay refuses it, and what to do.
[[nodiscard]] std::string describe(const SidewaysMotion& motion);
/// Fails (Unsupported) if the route moves sideways. `source` names its file in the error; may be empty.
[[nodiscard]] Status check_sideways(const Route& route, const std::string& source);

/// The place on a route where the hull is nearest to a tag.
struct NearestTag {
  TagId tag{};
  double clearance_m = 0;  ///< 3D distance from the hull to the tag
  double arc_length_m = 0;
  SE2 map_T_base{};
};

/// The nearest tag to the hull of a robot that drives the route. `nullopt` if the map is empty. O(points *
/// tags).
[[nodiscard]] std::optional<NearestTag> nearest_tag(const Route& route, const TagMap& map, const Hull& hull);
/// The message that the limiter of a replay stops at this tag, and what to do; empty if it does not.
[[nodiscard]] std::string describe_too_near(const NearestTag& nearest, const SafetyOptions& options = {});

}  // namespace waymark

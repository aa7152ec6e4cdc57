#include "waymark/replay/route_checks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Core>

#include "waymark/base/angles.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr const char* kTeachFacingAhead =
    "Teach the lap again with the robot facing its direction of motion. If it did, check the yaw of its "
    "camera mounting.";

bool reverses(const RoutePoint& point) { return point.speed_m_s < 0; }

/// The neighbours of a point on the same leg of a route; the point itself where there is none.
struct Neighbours {
  std::size_t before = 0;
  std::size_t after = 0;
};

class RouteLegs {
 public:
  explicit RouteLegs(const Route& route) : points_(route.points) {
    const auto turns = [&](const RoutePoint& p) { return reverses(p) != reverses(points_.front()); };
    wraps_ = route.closed && std::ranges::none_of(points_, turns);
  }

  [[nodiscard]] Neighbours beside(std::size_t i) const {
    const std::size_t n = points_.size();
    const std::size_t before = i > 0 ? i - 1 : (wraps_ ? n - 1 : i);
    const std::size_t after = i + 1 < n ? i + 1 : (wraps_ ? 0 : i);
    return {.before = reverses(points_[before]) == reverses(points_[i]) ? before : i,
            .after = reverses(points_[after]) == reverses(points_[i]) ? after : i};
  }

  /// The heading of a robot that moves straight from one point to another without moving sideways. `nullopt`
  /// if they coincide.
  [[nodiscard]] std::optional<double> heading(std::size_t from, std::size_t to) const {
    const Eigen::Vector2d moved =
        points_[to].map_T_base.translation() - points_[from].map_T_base.translation();
    constexpr double kSamePoint_m = 1e-6;
    if (moved.norm() < kSamePoint_m) return std::nullopt;
    return std::atan2(moved.y(), moved.x()) + (reverses(points_[to]) ? std::numbers::pi : 0.0);
  }

 private:
  const std::vector<RoutePoint>& points_;
  bool wraps_ = false;
};

double remainder_of_turn(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

/// Angle from the nearest heading without sideways motion at point i to its heading. At a corner these are
/// all headings between those before and after it. Zero if unknown.
double sideways_at(const Route& route, const RouteLegs& legs, std::size_t i) {
  const auto [before, after] = legs.beside(i);
  const auto arriving = legs.heading(before, i);
  const auto leaving = legs.heading(i, after);
  if (!arriving && !leaving) return 0;
  const double first = arriving ? *arriving : *leaving;
  const double turn = leaving ? remainder_of_turn(*leaving - first) : 0;
  const double from_first = remainder_of_turn(route.points[i].map_T_base.yaw() - first);
  if (from_first >= std::min(turn, 0.0) && from_first <= std::max(turn, 0.0)) return 0;
  const double from_last = remainder_of_turn(from_first - turn);
  return std::abs(from_first) < std::abs(from_last) ? from_first : from_last;
}

/// Length of the route from a point to the next.
double spacing_after(const Route& route, std::size_t i) {
  const double next_m = i + 1 < route.points.size() ? route.points[i + 1].arc_length_m : route.length_m;
  return next_m - route.points[i].arc_length_m;
}

/// Largest horizontal distance of a point of the hull from the origin of the base.
double reach_of(const Hull& hull) {
  return std::hypot(std::max(hull.front_m, hull.rear_m), hull.width_m / 2);
}

std::string sideways_text(const SidewaysMotion& motion) {
  return fmt::format(
      "the robot moved sideways along {:.2f} m of the route, from {:.2f} m on: its heading was up to "
      "{:.0f} deg to the {} of its direction of motion. A replay cannot drive sideways (limit {:.0f} deg)",
      motion.length_m, motion.arc_length_m, to_degrees(std::abs(motion.angle_rad)),
      motion.angle_rad > 0 ? "left" : "right", to_degrees(kMaxSideways_rad));
}

}  // namespace

std::vector<double> driving_headings(const Route& route) {
  std::vector<double> headings;
  headings.reserve(route.points.size());
  if (route.points.empty()) return headings;
  const RouteLegs legs(route);
  for (std::size_t i = 0; i < route.points.size(); ++i) {
    const auto [before, after] = legs.beside(i);
    headings.push_back(legs.heading(before, after).value_or(route.points[i].map_T_base.yaw()));
  }
  return headings;
}

Route facing_along(Route route) {
  const std::vector<double> headings = driving_headings(route);
  for (std::size_t i = 0; i < headings.size(); ++i) {
    SE2& map_T_base = route.points[i].map_T_base;
    map_T_base = SE2(map_T_base.x(), map_T_base.y(), headings[i]);
  }
  return route;
}

std::optional<SidewaysMotion> sideways_motion(const Route& route) {
  if (route.points.empty()) return std::nullopt;
  const RouteLegs legs(route);
  std::optional<SidewaysMotion> found;
  for (std::size_t i = 0; i < route.points.size(); ++i) {
    const double angle_rad = sideways_at(route, legs, i);
    if (std::abs(angle_rad) <= kMaxSideways_rad) continue;
    const RoutePoint& point = route.points[i];
    if (!found) found = {.point = i, .arc_length_m = point.arc_length_m, .map_T_base = point.map_T_base};
    if (std::abs(angle_rad) > std::abs(found->angle_rad)) found->angle_rad = angle_rad;
    found->length_m += spacing_after(route, i);
  }
  return found;
}

std::string describe(const SidewaysMotion& motion) {
  return fmt::format("{}. {}", sideways_text(motion), kTeachFacingAhead);
}

Status check_sideways(const Route& route, const std::string& source) {
  const auto motion = sideways_motion(route);
  if (!motion) return {};
  Place place{.source = source};
  if (!source.empty()) place.key = fmt::format("points[{}]", motion->point);
  return fail(ErrorCode::Unsupported, sideways_text(*motion), std::move(place), kTeachFacingAhead);
}

std::optional<NearestTag> nearest_tag(const Route& route, const TagMap& map, const Hull& hull) {
  std::optional<NearestTag> nearest;
  const double hull_reach_m = reach_of(hull);
  for (const RoutePoint& point : facing_along(route).points) {
    for (const auto& [tag, mapped] : map.tags) {
      const double apart_m =
          (mapped.map_T_tag.translation().head<2>() - point.map_T_base.translation()).norm();
      const double least_m = apart_m - hull_reach_m - mapped.size_m / std::numbers::sqrt2;
      if (nearest && least_m >= nearest->clearance_m) continue;
      const double distance_m = clearance_m(hull, lift(point.map_T_base), mapped);
      if (nearest && distance_m >= nearest->clearance_m) continue;
      nearest = {tag, distance_m, point.arc_length_m, point.map_T_base};
    }
  }
  return nearest;
}

std::string describe_too_near(const NearestTag& nearest, const SafetyOptions& options) {
  if (nearest.clearance_m >= options.min_clearance_m) return {};
  return fmt::format(
      "the hull passes {} at {:.2f} m, {:.2f} m along the route. A replay stops there (limit {:g} m). "
      "Teach the lap farther from this tag, move the tag, or replay with a smaller `min_clearance_m`",
      to_string(nearest.tag), nearest.clearance_m, nearest.arc_length_m, options.min_clearance_m);
}

}  // namespace waymark

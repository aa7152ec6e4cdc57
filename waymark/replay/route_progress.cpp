#include "waymark/replay/route_progress.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace waymark {
namespace {

/// The segment from point i to the next one.
struct Segment {
  Eigen::Vector2d from;
  Eigen::Vector2d to;
  double arc_from = 0;
  double arc_to = 0;
};

Segment segment(const Route& route, std::size_t i) {
  const bool wraps = i + 1 == route.points.size();
  const RoutePoint& a = route.points[i];
  const RoutePoint& b = route.points[wraps ? 0 : i + 1];
  return {a.map_T_base.translation(), b.map_T_base.translation(), a.arc_length_m,
          wraps ? route.length_m : b.arc_length_m};
}

std::size_t segments(const Route& route) {
  return route.closed ? route.points.size() : route.points.size() - 1;
}

double blend_angle(double a, double b, double u) {
  return a + u * std::remainder(b - a, 2 * std::numbers::pi);
}

RouteProgress foot_on(const Route& route, std::size_t i, const SE2& map_T_base) {
  const Segment s = segment(route, i);
  const Eigen::Vector2d along = s.to - s.from;
  const double u = std::clamp(
      (map_T_base.translation() - s.from).dot(along) / std::max(along.squaredNorm(), 1e-18), 0.0, 1.0);
  const double yaw = blend_angle(route.points[i].map_T_base.yaw(),
                                 route.points[(i + 1) % route.points.size()].map_T_base.yaw(), u);
  const Eigen::Vector2d foot = s.from + u * along;
  RouteProgress progress{.index = i,
                         .arc_length_m = s.arc_from + u * (s.arc_to - s.arc_from),
                         .map_T_route = SE2(foot.x(), foot.y(), yaw)};
  const SE2 route_T_base = progress.map_T_route.inverse() * map_T_base;
  progress.cross_track_m = std::copysign((map_T_base.translation() - foot).norm(), route_T_base.y());
  progress.heading_error_rad = route_T_base.yaw();
  progress.leg_end_m = route.length_m;
  return progress;
}

bool backwards(const Route& route, std::size_t i) { return route.points[i].speed_m_s < 0; }

/// Whether the segment after a point is driven backwards. A segment has the direction of the point at its
/// end; a point where the direction changes is the last one of its leg.
bool stretch_backwards(const Route& route, std::size_t i) {
  return backwards(route, (i + 1) % route.points.size());
}

/// Sets the leg of a foot point. On a closed route with changes of direction, a leg begins at the first
/// point.
void find_leg(const Route& route, RouteProgress& progress) {
  const bool way = stretch_backwards(route, progress.index);
  std::size_t first = progress.index;
  std::size_t last = progress.index;
  while (first > 0 && stretch_backwards(route, first - 1) == way) --first;
  while (last + 1 < segments(route) && stretch_backwards(route, last + 1) == way) ++last;
  progress.leg_begin_m = route.points[first].arc_length_m;
  progress.leg_end_m = segment(route, last).arc_to;
}

bool changes_direction(const Route& route) {
  return std::ranges::any_of(
      route.points, [&](const RoutePoint& point) { return (point.speed_m_s < 0) != backwards(route, 0); });
}

/// Cost of a foot point when choosing between branches [m].
double branch_cost(const RouteProgress& at) {
  constexpr double kMetresPerRadian = 0.3;
  return std::hypot(at.cross_track_m, kMetresPerRadian * at.heading_error_rad);
}

}  // namespace

RouteProgress locate(const Route& route, const SE2& map_T_base, double from_m) {
  assert(route.points.size() >= 2);
  RouteProgress best{.cross_track_m = std::numeric_limits<double>::infinity()};
  for (std::size_t i = 0; i < segments(route); ++i) {
    if (segment(route, i).arc_to < from_m) continue;
    const RouteProgress here = foot_on(route, i, map_T_base);
    if (branch_cost(here) < branch_cost(best)) best = here;
  }
  if (std::isinf(best.cross_track_m)) best = foot_on(route, segments(route) - 1, map_T_base);
  if (changes_direction(route)) find_leg(route, best);
  return best;
}

RouteProgress advance(const Route& route, const SE2& map_T_base, const RouteProgress& before, double window_m,
                      double turn_within_m) {
  assert(route.points.size() >= 2);
  const auto count = static_cast<std::ptrdiff_t>(segments(route));
  const double step = route.length_m / static_cast<double>(count);
  const auto ahead =
      std::min<std::ptrdiff_t>(count - 1, static_cast<std::ptrdiff_t>(std::ceil(window_m / step)));
  const std::ptrdiff_t back = std::min<std::ptrdiff_t>(count - 1 - ahead, 2);
  const bool legs = before.leg_end_m > 0 && (before.leg_begin_m > 0 || before.leg_end_m < route.length_m);
  const bool another = before.leg_end_m < route.length_m - 1e-9;
  const bool turning = legs && another && before.leg_end_m - before.arc_length_m <= turn_within_m;
  const auto in_reach = [&](std::size_t i) {
    if (!legs) return true;
    const double middle = route.points[i].arc_length_m;
    if (turning) return middle >= before.leg_end_m - 1e-9;
    return middle >= before.leg_begin_m - 1e-9 && middle < before.leg_end_m - 1e-9;
  };
  RouteProgress best{.cross_track_m = std::numeric_limits<double>::infinity()};
  for (std::ptrdiff_t k = -back; k <= ahead; ++k) {
    std::ptrdiff_t i = static_cast<std::ptrdiff_t>(before.index) + k;
    if (route.closed) i = (i + count) % count;
    if (i < 0 || i >= count || !in_reach(static_cast<std::size_t>(i))) continue;
    const RouteProgress here = foot_on(route, static_cast<std::size_t>(i), map_T_base);
    if (std::abs(here.cross_track_m) < std::abs(best.cross_track_m)) best = here;
  }
  if (std::isinf(best.cross_track_m)) return before;
  if (legs) find_leg(route, best);
  return best;
}

SE2 pose_at(const Route& route, double arc_length_m) {
  assert(route.points.size() >= 2);
  double s = arc_length_m;
  if (route.closed) s -= route.length_m * std::floor(s / route.length_m);
  s = std::clamp(s, 0.0, route.length_m);
  const auto after = std::ranges::upper_bound(route.points, s, {}, &RoutePoint::arc_length_m);
  const auto i =
      std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - route.points.begin() - 1, 0)),
               segments(route) - 1);
  const Segment stretch = segment(route, i);
  const double u =
      std::clamp((s - stretch.arc_from) / std::max(stretch.arc_to - stretch.arc_from, 1e-18), 0.0, 1.0);
  const Eigen::Vector2d p = (1 - u) * stretch.from + u * stretch.to;
  const double yaw = blend_angle(route.points[i].map_T_base.yaw(),
                                 route.points[(i + 1) % route.points.size()].map_T_base.yaw(), u);
  return {p.x(), p.y(), yaw};
}

namespace {

constexpr double kSamePlace_m = 0.1;
constexpr double kBeyond_m = 1e-6;

}  // namespace

/// Selects the nearest station at or beyond a travelled distance.
void StationStops::aim(double from_m) {
  next_way_m_.reset();
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    double way_m = stations_[i].arc_length_m;
    if (closed_) way_m += length_m_ * std::ceil((from_m - way_m) / length_m_);
    if (way_m < from_m || (next_way_m_ && way_m >= *next_way_m_)) continue;
    next_ = i;
    next_way_m_ = way_m;
  }
}

void StationStops::begin(double way_m) {
  if (at_station_ && std::abs(way_m - *next_way_m_) < kSamePlace_m) return;
  at_station_ = false;
  const double from_m = way_m - kSamePlace_m;
  aim(served_way_m_ ? std::max(from_m, *served_way_m_ + kBeyond_m) : from_m);
  // A station at the start of a closed route is served at the end of each lap.
  const bool at_seam = closed_ && !served_way_m_ && next_way_m_ && *next_way_m_ < kBeyond_m;
  if (at_seam) aim(kBeyond_m);
}

void StationStops::arrive(double way_m, double within_m) {
  if (at_station_ || left_m(way_m) > within_m) return;
  at_station_ = true;
  left_s_ = stations_[next_].pause_s;
}

void StationStops::dwell(double dt_s) {
  if (!at_station_) return;
  left_s_ -= dt_s;
  if (left_s_ > 0) return;
  at_station_ = false;
  served_way_m_ = next_way_m_;
  aim(*served_way_m_ + kBeyond_m);
}

double StationStops::left_m(double way_m) const {
  return next_way_m_ ? *next_way_m_ - way_m : std::numeric_limits<double>::infinity();
}

}  // namespace waymark

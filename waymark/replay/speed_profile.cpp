#include "waymark/replay/speed_profile.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace waymark {
namespace {

double distance_to_next(const Route& route, std::size_t i) {
  const std::size_t n = route.points.size();
  const double next = i + 1 < n ? route.points[i + 1].arc_length_m : route.length_m;
  return std::max(next - route.points[i].arc_length_m, 0.0);
}

bool same_way(const RoutePoint& a, const RoutePoint& b) { return (a.speed_m_s < 0) == (b.speed_m_s < 0); }

double local_limit(const RoutePoint& point, const ProfileOptions& options) {
  const double curvature = std::max(std::abs(point.curvature_1_m), 1e-9);
  const double asked = options.speed_m_s > 0 ? options.speed_m_s : std::abs(point.speed_m_s);
  return std::min(
      {asked, std::sqrt(options.lateral_acceleration_m_s2 / curvature), options.turning_rad_s / curvature});
}

}  // namespace

Route with_speed_profile(Route route, const ProfileOptions& options) {
  const std::size_t n = route.points.size();
  if (n < 2) return route;
  const double crawl_m_s =
      options.speed_m_s > 0 ? std::min(options.crawl_m_s, options.speed_m_s) : options.crawl_m_s;
  std::vector<double> speed(n);
  for (std::size_t i = 0; i < n; ++i) {
    speed[i] = std::max(local_limit(route.points[i], options), crawl_m_s);
    const bool last = i + 1 == n;
    const bool at_standstill = last ? !route.closed : !same_way(route.points[i], route.points[i + 1]);
    if (at_standstill) speed[i] = crawl_m_s;
  }
  const std::size_t rounds =
      route.closed ? 2 * n : n - 1;  // twice, because the start of a lap depends on its end
  for (std::size_t k = 0; k < rounds; ++k) {
    const std::size_t i = k % n;
    const std::size_t next = (i + 1) % n;
    const double most =
        std::sqrt(speed[i] * speed[i] + 2 * options.acceleration_m_s2 * distance_to_next(route, i));
    speed[next] = std::min(speed[next], most);
  }
  for (std::size_t k = 0; k < rounds; ++k) {
    const std::size_t i = (2 * n - 2 - (k % n) + (route.closed ? 1 : 0)) % n;
    const std::size_t next = (i + 1) % n;
    const double most =
        std::sqrt(speed[next] * speed[next] + 2 * options.deceleration_m_s2 * distance_to_next(route, i));
    speed[i] = std::min(speed[i], most);
  }
  for (std::size_t i = 0; i < n; ++i)
    route.points[i].speed_m_s = std::copysign(speed[i], route.points[i].speed_m_s);
  return route;
}

double speed_at(const Route& route, std::size_t index, double arc_length_m) {
  const std::size_t n = route.points.size();
  const RoutePoint& a = route.points[index];
  const bool has_next = index + 1 < n || route.closed;
  if (!has_next) return a.speed_m_s;
  const RoutePoint& b = route.points[(index + 1) % n];
  const double stretch = std::max(distance_to_next(route, index), 1e-12);
  const double u = std::clamp((arc_length_m - a.arc_length_m) / stretch, 0.0, 1.0);
  // With constant acceleration, the squared speed is linear in the distance.
  const double squared = (1 - u) * a.speed_m_s * a.speed_m_s + u * b.speed_m_s * b.speed_m_s;
  // At a change of direction, the segment after the turning point belongs to the next leg.
  return std::copysign(std::sqrt(squared), b.speed_m_s);
}

double duration_s(const Route& route) {
  double total = 0;
  const std::size_t n = route.points.size();
  for (std::size_t i = 0; i < (route.closed ? n : n - 1); ++i) {
    const double mean =
        (std::abs(route.points[i].speed_m_s) + std::abs(route.points[(i + 1) % n].speed_m_s)) / 2;
    total += distance_to_next(route, i) / std::max(mean, 1e-6);
  }
  return total;
}

}  // namespace waymark

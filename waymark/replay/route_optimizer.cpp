#include "waymark/replay/route_optimizer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "waymark/geometry/planar.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/replay/route_checks.hpp"
#include "waymark/replay/route_progress.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using internal::Line;

constexpr int kOffsets = 11;  // number of offsets in the grid; odd, so that the taught route is one of them

/// The offsets surveyed at one point on the taught route.
struct SurveyedPlace {
  Eigen::Vector2d map_p = Eigen::Vector2d::Zero();
  Eigen::Vector2d left = Eigen::Vector2d::Zero();
  std::array<double, kOffsets> clearance_m{};
  std::array<double, kOffsets> tags{};
  double least_m = 0;  ///< range of the allowed offsets
  double most_m = 0;
};

double offset_of(int k, double corridor_m) { return corridor_m * (2.0 * k / (kOffsets - 1) - 1); }

double tags_seen(const SE2& map_T_base, const RouteScene& scene) {
  const SE3 map_T_cam = lift(map_T_base) * scene.robot->base_T_cam;
  return static_cast<double>(visible_tags(*scene.tags, *scene.camera, map_T_cam).size());
}

SurveyedPlace survey(const SE2& map_T_base, const RouteScene& scene, double corridor_m) {
  SurveyedPlace station{.map_p = map_T_base.translation()};
  station.left = map_T_base.rotation() * Eigen::Vector2d(0, 1);
  for (int k = 0; k < kOffsets; ++k) {
    const SE2 at = map_T_base * SE2(0, offset_of(k, corridor_m), 0);
    station.clearance_m[static_cast<std::size_t>(k)] = clearance_m(scene.robot->hull, lift(at), *scene.tags);
    station.tags[static_cast<std::size_t>(k)] = tags_seen(at, scene);
  }
  return station;
}

/// Extends the allowed range to both sides as long as clearance and visibility are no worse than on the
/// taught route.
void find_allowed(SurveyedPlace& station, double least_clearance_m, double corridor_m) {
  constexpr int kMiddle = kOffsets / 2;
  const double needed = std::min(2.0, station.tags[kMiddle]);
  const auto good = [&](int k) {
    return station.clearance_m[static_cast<std::size_t>(k)] >= least_clearance_m &&
           station.tags[static_cast<std::size_t>(k)] >= needed;
  };
  int least = kMiddle;
  int most = kMiddle;
  while (least > 0 && good(least - 1)) --least;
  while (most + 1 < kOffsets && good(most + 1)) ++most;
  station.least_m = offset_of(least, corridor_m);
  station.most_m = offset_of(most, corridor_m);
}

double look_up(const std::array<double, kOffsets>& grid, double offset_m, double corridor_m) {
  const double at = std::clamp((offset_m / corridor_m + 1) * (kOffsets - 1) / 2, 0.0, kOffsets - 1.0);
  const auto k = std::min(static_cast<std::size_t>(at), static_cast<std::size_t>(kOffsets - 2));
  const double u = at - static_cast<double>(k);
  return (1 - u) * grid[k] + u * grid[k + 1];
}

/// Moves stations to the corresponding points on the other route; both routes have the same number of points.
void take_stations(const Route& like, Route& route) {
  const auto arc_at = [](const Route& of, std::size_t i) {
    return i < of.points.size() ? of.points[i].arc_length_m : of.length_m;
  };
  for (Station station : like.stations) {
    std::size_t i = 0;
    while (i + 1 < like.points.size() && like.points[i + 1].arc_length_m <= station.arc_length_m) ++i;
    const double stretch = std::max(arc_at(like, i + 1) - arc_at(like, i), 1e-12);
    const double u = std::clamp((station.arc_length_m - arc_at(like, i)) / stretch, 0.0, 1.0);
    station.arc_length_m = (1 - u) * arc_at(route, i) + u * arc_at(route, i + 1);
    route.stations.push_back(std::move(station));
  }
}

Route route_along(const Line& line, const Route& like) {
  Route route{.closed = like.closed};
  const std::vector<double> bent = internal::curvatures(line, like.closed);
  const std::size_t n = line.size();
  double arc = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (i > 0) arc += (line[i] - line[i - 1]).norm();
    const std::size_t before = i > 0 ? i - 1 : (like.closed ? n - 1 : 0);
    const std::size_t after = i + 1 < n ? i + 1 : (like.closed ? 0 : n - 1);
    const Eigen::Vector2d d = line[after] - line[before];
    route.points.push_back({.map_T_base = SE2(line[i].x(), line[i].y(), std::atan2(d.y(), d.x())),
                            .arc_length_m = arc,
                            .curvature_1_m = bent[i],
                            .speed_m_s = like.points[i].speed_m_s});
  }
  route.length_m = like.closed ? arc + (line.front() - line.back()).norm() : arc;
  take_stations(like, route);
  return route;
}

double smoothness(const Route& route) {
  double sum = 0;
  const std::size_t n = route.points.size();
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const RoutePoint& a = route.points[i];
    const RoutePoint& b = route.points[i + 1];
    const double way = std::max(b.arc_length_m - a.arc_length_m, 1e-9);
    sum += std::pow(b.curvature_1_m - a.curvature_1_m, 2) / way;
  }
  return sum / std::max(route.length_m, 1e-9);
}

/// The search, which varies the offset at every point by adding smooth bumps.
class Search {
 public:
  Search(const Route& taught, const RouteScene& scene, const ProfileOptions& profile,
         const OptimizerOptions& options)
      : taught_(taught), profile_(profile), options_(options), offsets_(taught.points.size(), 0.0) {
    double least_clearance = std::numeric_limits<double>::infinity();
    for (const RoutePoint& point : taught.points) {
      stations_.push_back(survey(point.map_T_base, scene, options.corridor_m));
      least_clearance = std::min(least_clearance, stations_.back().clearance_m[kOffsets / 2]);
    }
    for (SurveyedPlace& station : stations_) find_allowed(station, least_clearance, options.corridor_m);
    taught_s_ = duration_s(with_speed_profile(taught, profile));
  }

  Route run(double border_weight) {
    border_weight_ = border_weight;
    std::ranges::fill(offsets_, 0.0);
    cost_ = cost();
    for (int round = 0; round < static_cast<int>(options_.rounds); ++round) {
      const double before = cost_;
      for (double width = taught_.length_m / 4; width >= options_.narrowest_m; width /= 1.6) sweep(width);
      if (before - cost_ < 1e-5) break;
    }
    return route_of();
  }

 private:
  /// Varies bumps of one width until no change reduces the cost.
  void sweep(double half_width_m) {
    const double between = half_width_m / 2;
    const auto bumps = static_cast<int>(std::max(1.0, std::round(taught_.length_m / between)));
    for (double height = options_.corridor_m / 2; height > options_.corridor_m / 150; height /= 2.5) {
      for (int k = 0; k < bumps; ++k) {
        const double middle = taught_.length_m * (k + 0.5) / bumps;
        if (!try_bump(middle, half_width_m, height)) try_bump(middle, half_width_m, -height);
      }
    }
  }

  bool try_bump(double middle_m, double half_width_m, double height_m) {
    const std::vector<double> kept = offsets_;
    for (std::size_t i = 0; i < offsets_.size(); ++i) {
      double away = taught_.points[i].arc_length_m - middle_m;
      if (taught_.closed) away = std::remainder(away, taught_.length_m);
      const double u = std::abs(away) / half_width_m;
      if (u >= 1) continue;
      double bump = std::pow(1 - u * u, 3);
      if (!taught_.closed) {  // the ends of an open route and their directions stay as taught
        const double s = taught_.points[i].arc_length_m;
        bump *= std::pow(std::clamp(std::min(s, taught_.length_m - s) / 0.5, 0.0, 1.0), 3);
      }
      offsets_[i] += height_m * bump;
      if (std::abs(offsets_[i]) <= options_.corridor_m) continue;
      offsets_ = kept;
      return false;
    }
    const double now = cost();
    if (now < cost_) {
      cost_ = now;
      return true;
    }
    offsets_ = kept;
    return false;
  }

  [[nodiscard]] Route route_of() const {
    Line line;
    line.reserve(offsets_.size());
    for (std::size_t i = 0; i < stations_.size(); ++i)
      line.emplace_back(stations_[i].map_p + offsets_[i] * stations_[i].left);
    return route_along(line, taught_);
  }

  [[nodiscard]] double cost() const {
    const Route route = route_of();
    double near = 0;
    double missing = 0;
    double bent = 0;
    double beyond = 0;
    for (std::size_t i = 0; i < stations_.size(); ++i) {
      const double offset = offsets_[i];
      const double clearance = look_up(stations_[i].clearance_m, offset, options_.corridor_m);
      near += std::pow(std::max(0.0, 1 - clearance / options_.wanted_clearance_m), 2);
      missing +=
          std::max(0.0, options_.wanted_tags - look_up(stations_[i].tags, offset, options_.corridor_m));
      const double allowed = std::clamp(offset, stations_[i].least_m, stations_[i].most_m);
      beyond += std::pow((offset - allowed) / options_.corridor_m, 2);
      const double tight = std::max(options_.max_curvature_1_m, std::abs(taught_.points[i].curvature_1_m));
      bent += std::pow(std::max(0.0, std::abs(route.points[i].curvature_1_m) - 0.99 * tight), 2);
    }
    const auto n = static_cast<double>(stations_.size());
    return options_.time_weight * duration_s(with_speed_profile(route, profile_)) / taught_s_ +
           options_.smoothness_weight * smoothness(route) + options_.clearance_weight * near / n +
           options_.visibility_weight * missing / n + 30 * bent / n + border_weight_ * beyond / n;
  }

  const Route& taught_;
  ProfileOptions profile_;
  OptimizerOptions options_;
  std::vector<SurveyedPlace> stations_{};
  std::vector<double> offsets_;
  double taught_s_ = 1;
  double cost_ = 0;
  double border_weight_ = 0;
};

/// Compares the routes themselves, because the limits on the grid are only coarse.
bool no_worse(const RouteFigures& a, const RouteFigures& taught) {
  constexpr double kRoundingMetres = 1e-3;
  return a.min_clearance_m >= taught.min_clearance_m - kRoundingMetres &&
         a.two_tags_fraction >= taught.two_tags_fraction;
}

}  // namespace

RouteFigures route_figures(const Route& route, const Route& taught, const RouteScene& scene,
                           const ProfileOptions& profile) {
  RouteFigures figures{.lap_s = duration_s(with_speed_profile(route, profile)),
                       .length_m = route.length_m,
                       .smoothness_1_m4 = smoothness(route),
                       .min_clearance_m = std::numeric_limits<double>::infinity()};
  for (const RoutePoint& point : route.points) {
    figures.max_curvature_1_m = std::max(figures.max_curvature_1_m, std::abs(point.curvature_1_m));
    figures.min_clearance_m = std::min(figures.min_clearance_m,
                                       clearance_m(scene.robot->hull, lift(point.map_T_base), *scene.tags));
    const double seen = tags_seen(point.map_T_base, scene);
    figures.mean_tags += seen;
    figures.two_tags_fraction += seen >= 2 ? 1 : 0;
    figures.largest_offset_m =
        std::max(figures.largest_offset_m, std::abs(locate(taught, point.map_T_base).cross_track_m));
  }
  figures.mean_tags /= static_cast<double>(route.points.size());
  figures.two_tags_fraction /= static_cast<double>(route.points.size());
  return figures;
}

Result<OptimizedRoute> optimize_route(const Route& as_taught, const RouteScene& scene,
                                      const ProfileOptions& profile, const OptimizerOptions& options) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  if (Status status = check_ranges(profile); !status) return tl::unexpected(status.error());
  for (const RoutePoint& point : as_taught.points) {
    if (point.speed_m_s < 0)
      return fail(ErrorCode::Unsupported, "a route that reverses cannot be optimised", {},
                  "Optimise a route that is driven forwards only.");
  }
  if (Status ahead = check_sideways(as_taught, {}); !ahead) return tl::unexpected(ahead.error());
  const Route taught = facing_along(as_taught);  // offsets are measured across the direction of motion
  if (taught.points.size() < 8)
    return fail(ErrorCode::InvalidArgument, "a route of fewer than 8 points cannot be optimised");
  OptimizedRoute result{.taught = route_figures(taught, taught, scene, profile)};
  Search search(taught, scene, profile, options);
  double border_weight = 3;
  for (int attempt = 0; attempt < 4; ++attempt, border_weight *= 10) {
    result.route = search.run(border_weight);
    result.optimized = route_figures(result.route, taught, scene, profile);
    if (no_worse(result.optimized, result.taught)) return result;
  }
  result.route = as_taught;
  result.optimized = result.taught;
  return result;
}

}  // namespace waymark

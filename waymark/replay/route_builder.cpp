#include "waymark/replay/route_builder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>

#include "waymark/geometry/planar.hpp"
#include "waymark/replay/lap_closing.hpp"
#include "waymark/replay/line_smoothing.hpp"

namespace waymark {
namespace {

using internal::Line;

double heading(const Line& line, std::size_t i, bool closed) {
  const std::size_t n = line.size();
  const std::size_t before = i > 0 ? i - 1 : (closed ? n - 1 : 0);
  const std::size_t after = i + 1 < n ? i + 1 : (closed ? 0 : n - 1);
  const Eigen::Vector2d d = line[after] - line[before];
  return std::atan2(d.y(), d.x());
}

Eigen::Vector2d sideways_gap(const Line& line) {
  const Eigen::Vector2d along = (line[1] - line[0]).normalized();
  const Eigen::Vector2d gap = line.front() - line.back();
  return gap - gap.dot(along) * along;
}

/// The sideways part of the gap between the end of a lap and its start, spread over a metre, so that the
/// route closes without a step. Where the lap went on beyond its start it is spread there: both passes are
/// what was taught, and so is what lies between them. Else the end of the lap gives way. Along the route the
/// last stretch is simply shorter or longer.
void close_gap(Line& line, double step_m, std::size_t overlap) {
  constexpr std::size_t kLeastOverlap = 4;
  if ((line.front() - line.back()).norm() < step_m / 3) line.pop_back();
  const Eigen::Vector2d sideways = sideways_gap(line);
  auto spread = std::min<std::size_t>(line.size() / 2, static_cast<std::size_t>(std::lround(1.0 / step_m)));
  const bool overlaps = overlap >= kLeastOverlap;
  if (overlaps) spread = std::min(spread, overlap);
  for (std::size_t k = 0; k < spread; ++k) {
    const double along = static_cast<double>(k) / static_cast<double>(spread);
    const double share = 0.5 * (1 + std::cos(std::numbers::pi * along));
    if (overlaps)
      line[k] -= share * sideways;
    else
      line[line.size() - 1 - k] += share * sideways;
  }
}

/// Every point of the line moved to the mean of the driven points nearest to it: all of them count, not only
/// those that happened to end a step. Points are matched in order, so a line may cross itself.
Line average_onto(const Line& line, const Line& driven) {
  Line sum(line.size(), Eigen::Vector2d::Zero());
  std::vector<double> count(line.size(), 0);
  std::size_t i = 0;
  for (const auto& point : driven) {
    while (i + 1 < line.size() && (line[i + 1] - point).norm() < (line[i] - point).norm()) ++i;
    sum[i] += point;
    count[i] += 1;
  }
  for (std::size_t k = 0; k < line.size(); ++k)
    sum[k] = count[k] > 0 ? Eigen::Vector2d(sum[k] / count[k]) : line[k];
  return sum;
}

/// A stretch of the drive without a change of direction.
struct Leg {
  Line driven{};
  bool backwards = false;
};

/// Where the robot reversed for good: a few centimetres the other way are a hand that slipped.
std::vector<Leg> legs_of(const Trajectory& trajectory) {
  constexpr double kReversedMetres = 0.10;
  std::vector<Leg> legs(1);
  double reversed_m = 0;
  std::size_t reversed_from = 0;  // point of the present leg where it began to go the other way
  bool known = false;
  for (const StampedPose& pose : trajectory) {
    const SE2 map_T_base = project_to_plane(pose.map_T_base);
    Leg& leg = legs.back();
    if (!leg.driven.empty()) {
      const Eigen::Vector2d ahead(std::cos(map_T_base.yaw()), std::sin(map_T_base.yaw()));
      const double moved = (map_T_base.translation() - leg.driven.back()).dot(ahead);
      if (reversed_m <= 0) reversed_from = leg.driven.size() - 1;
      reversed_m = std::max(0.0, reversed_m + (leg.backwards ? moved : -moved));
    }
    leg.driven.push_back(map_T_base.translation());
    if (reversed_m < kReversedMetres) continue;
    const bool backwards = !leg.backwards;
    reversed_m = 0;
    if (!known && legs.size() == 1 && reversed_from == 0) {
      leg.backwards = backwards;
    } else {
      Leg next{
          .driven = Line(leg.driven.begin() + static_cast<std::ptrdiff_t>(reversed_from), leg.driven.end()),
          .backwards = backwards};
      leg.driven.resize(reversed_from + 1);
      legs.push_back(std::move(next));
    }
    known = true;
  }
  return legs;
}

/// A leg becomes points of the route behind those that are there.
void append(Route& route, const Line& line, bool closed, double signed_speed_m_s) {
  const bool backwards = signed_speed_m_s < 0;
  const std::vector<double> bent = internal::curvatures(line, closed);
  const double begin = route.points.empty() ? 0 : route.points.back().arc_length_m;
  double arc = begin;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Eigen::Vector2d before =
        i > 0 ? line[i - 1] : (route.points.empty() ? line[0] : route.points.back().map_T_base.translation());
    arc += (line[i] - before).norm();
    const double yaw = heading(line, i, closed) + (backwards ? std::numbers::pi : 0.0);
    route.points.push_back({.map_T_base = SE2(line[i].x(), line[i].y(), yaw),
                            .arc_length_m = arc,
                            .curvature_1_m = bent[i],
                            .speed_m_s = signed_speed_m_s});
  }
  route.length_m = closed ? arc + (line.front() - line.back()).norm() : arc;
}

}  // namespace

Result<BuiltRoute> build_route(const Trajectory& trajectory, const RouteOptions& options) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  const std::vector<Leg> legs = legs_of(trajectory);
  const LapClosing closing{options.closing_distance_m, options.closing_angle_rad};
  BuiltRoute route;
  double driven_m = 0;
  for (const Leg& leg : legs) {
    Line line = even_steps(leg.driven, options.step_m).points;
    driven_m += static_cast<double>(line.size()) * options.step_m;
    if (line.size() < 3) continue;
    line = average_onto(line, leg.driven);
    const auto loop = legs.size() == 1 ? points_of_first_loop(line, options.step_m, closing) : std::nullopt;
    if (loop) {
      const std::size_t overlap = line.size() - *loop;
      route.repeated_m = static_cast<double>(overlap) * options.step_m;
      line.resize(*loop);
      close_gap(line, options.step_m, overlap);
    }
    route.closed = loop.has_value();
    line = internal::smooth_line(line, route.closed, options.step_m, options.smoothing_m,
                                 options.max_curvature_1_m);
    // A leg begins where the one before ended: that point is there already.
    if (!route.points.empty()) line.erase(line.begin());
    append(route, line, route.closed, leg.backwards ? -options.speed_m_s : options.speed_m_s);
  }
  if (driven_m < 0.5 || route.points.size() < 2) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the lap is only {:.2f} m long: too short for a route", driven_m), {},
                "Drive at least half a metre.");
  }
  return route;
}

}  // namespace waymark

#include "waymark/replay/route_builder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>

#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

using Line = std::vector<Eigen::Vector2d>;

double angle_between(double from, double to) { return std::remainder(to - from, 2 * std::numbers::pi); }

/// Points at even arc length. Jitter shorter than a step is not distance driven: a point counts once it is a
/// step away.
Line resample(const Line& points, double step_m) {
  Line even;
  for (const auto& point : points) {
    if (even.empty()) even.push_back(point);
    while ((point - even.back()).norm() >= step_m) {
      even.emplace_back(even.back() + (point - even.back()).normalized() * step_m);
    }
  }
  return even;
}

double heading(const Line& line, std::size_t i, bool closed) {
  const std::size_t n = line.size();
  const std::size_t before = i > 0 ? i - 1 : (closed ? n - 1 : 0);
  const std::size_t after = i + 1 < n ? i + 1 : (closed ? 0 : n - 1);
  const Eigen::Vector2d d = line[after] - line[before];
  return std::atan2(d.y(), d.x());
}

/// The direction driven about a point, over a stretch that the noise of single points does not turn.
double direction(const Line& line, std::size_t i, double step_m) {
  constexpr double kReachMetres = 0.25;
  const auto reach = static_cast<std::size_t>(std::max(1L, std::lround(kReachMetres / step_m)));
  const Eigen::Vector2d d = line[std::min(i + reach, line.size() - 1)] - line[i - std::min(i, reach)];
  return std::atan2(d.y(), d.x());
}

/// Where the lap is back at its start: the index behind the last point of the loop, or nothing.
std::optional<std::size_t> closing_point(const Line& line, const RouteOptions& options) {
  const double start_heading = direction(line, 0, options.step_m);
  bool left = false;
  std::optional<std::size_t> best;
  double best_distance = options.closing_distance_m;
  for (std::size_t i = 1; i < line.size(); ++i) {
    const double distance = (line[i] - line[0]).norm();
    left = left || distance > 2 * options.closing_distance_m;
    if (!left) continue;
    if (best && distance > options.closing_distance_m) break;  // past the first return
    const bool same_way = std::abs(angle_between(start_heading, direction(line, i, options.step_m))) <
                          options.closing_angle_rad;
    if (same_way && distance < best_distance) {
      best = i;
      best_distance = distance;
    }
  }
  return best;
}

/// The sideways part of the gap between the end of a lap and its start, spread over the last metre, so that
/// the route closes without a step. Along the route the last stretch is simply shorter or longer.
void close_gap(Line& line, double step_m) {
  if ((line.front() - line.back()).norm() < step_m / 3) line.pop_back();
  const Eigen::Vector2d along = (line[1] - line[0]).normalized();
  const Eigen::Vector2d gap = line.front() - line.back();
  const Eigen::Vector2d sideways = gap - gap.dot(along) * along;
  const auto spread =
      std::min<std::size_t>(line.size() / 2, static_cast<std::size_t>(std::lround(1.0 / step_m)));
  for (std::size_t k = 0; k < spread; ++k) {
    const double share = 1 - static_cast<double>(k) / static_cast<double>(spread);
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

/// Local weighted quadratic fits (Savitzky and Golay, Analytical Chemistry 36, 1964, with tricube weights):
/// straight lines and circles stay where they are, unlike under an average.
Line smooth(const Line& line, bool closed, double half_width_m, double step_m) {
  const auto half = static_cast<std::ptrdiff_t>(std::lround(2 * half_width_m / step_m));
  if (half < 2) return line;
  const auto n = static_cast<std::ptrdiff_t>(line.size());
  Line result(line.size());
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Matrix<double, 3, 2> b = Eigen::Matrix<double, 3, 2>::Zero();
    for (std::ptrdiff_t k = -half; k <= half; ++k) {
      const std::ptrdiff_t j = closed ? (i + k + n) % n : i + k;
      if (j < 0 || j >= n) continue;
      const double u = static_cast<double>(k) / static_cast<double>(half + 1);
      const double weight = std::pow(1 - std::pow(std::abs(u), 3), 3);
      const Eigen::Vector3d basis(1, u, u * u);
      A += weight * basis * basis.transpose();
      b += weight * basis * line[static_cast<std::size_t>(j)].transpose();
    }
    result[static_cast<std::size_t>(i)] = A.ldlt().solve(b).row(0).transpose();
  }
  return result;
}

Route as_route(const Line& line, bool closed, double speed_m_s) {
  Route route{.closed = closed};
  double arc = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (i > 0) arc += (line[i] - line[i - 1]).norm();
    const double yaw = heading(line, i, closed);
    route.points.push_back(
        {.map_T_base = SE2(line[i].x(), line[i].y(), yaw), .arc_length_m = arc, .speed_m_s = speed_m_s});
  }
  route.length_m = closed ? arc + (line.front() - line.back()).norm() : arc;
  const std::size_t n = line.size();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = i > 0 ? i - 1 : (closed ? n - 1 : 0);
    const std::size_t after = i + 1 < n ? i + 1 : (closed ? 0 : n - 1);
    double distance = route.points[after].arc_length_m - route.points[before].arc_length_m;
    if (distance <= 0) distance += route.length_m;
    route.points[i].curvature_1_m =
        angle_between(route.points[before].map_T_base.yaw(), route.points[after].map_T_base.yaw()) / distance;
  }
  return route;
}

}  // namespace

Result<Route> build_route(const Trajectory& trajectory, const RouteOptions& options) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  Line driven;
  driven.reserve(trajectory.size());
  for (const StampedPose& pose : trajectory)
    driven.push_back(project_to_plane(pose.map_T_base).translation());
  Line line = resample(driven, options.step_m);
  if (static_cast<double>(line.size()) * options.step_m < 0.5) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the lap is only {:.2f} m long: too short for a route",
                            static_cast<double>(line.size()) * options.step_m),
                {}, "Drive at least half a metre.");
  }
  line = average_onto(line, driven);
  const std::optional<std::size_t> closing = closing_point(line, options);
  if (closing) {
    line.resize(*closing);
    close_gap(line, options.step_m);
  }
  line = smooth(line, closing.has_value(), options.smoothing_m, options.step_m);
  return as_route(line, closing.has_value(), options.speed_m_s);
}

}  // namespace waymark

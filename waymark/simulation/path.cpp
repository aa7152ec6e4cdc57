#include "waymark/simulation/path.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace waymark {
namespace {

/// The curve from p1 to p2 at u in [0, 1].
Eigen::Vector2d catmull_rom(const std::array<Eigen::Vector2d, 4>& p, double u) {
  const auto knot = [&](std::size_t i) { return std::sqrt((p[i + 1] - p[i]).norm()); };
  const double t0 = 0;
  const double t1 = t0 + knot(0);
  const double t2 = t1 + knot(1);
  const double t3 = t2 + knot(2);
  const double t = t1 + u * (t2 - t1);
  const auto mix = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b, double ta,
                       double tb) -> Eigen::Vector2d { return ((tb - t) * a + (t - ta) * b) / (tb - ta); };
  const Eigen::Vector2d a1 = mix(p[0], p[1], t0, t1);
  const Eigen::Vector2d a2 = mix(p[1], p[2], t1, t2);
  const Eigen::Vector2d a3 = mix(p[2], p[3], t2, t3);
  return mix(mix(a1, a2, t0, t2), mix(a2, a3, t1, t3), t1, t2);
}

std::vector<Eigen::Vector2d> without_repeats(const std::vector<Eigen::Vector2d>& points, bool closed) {
  std::vector<Eigen::Vector2d> distinct;
  for (const auto& point : points) {
    if (distinct.empty() || (point - distinct.back()).norm() > 1e-9) distinct.push_back(point);
  }
  if (closed && distinct.size() > 1 && (distinct.front() - distinct.back()).norm() < 1e-9)
    distinct.pop_back();
  return distinct;
}

/// Dense points along the curve; a closed one ends where it began.
std::vector<Eigen::Vector2d> dense_curve(const std::vector<Eigen::Vector2d>& points, bool closed) {
  constexpr int kStepsPerSpan = 50;
  const auto count = static_cast<std::ptrdiff_t>(points.size());
  const auto at = [&](std::ptrdiff_t i) -> Eigen::Vector2d {
    if (closed) return points[static_cast<std::size_t>((i + count) % count)];
    if (i < 0) return 2 * points.front() - points[1];
    if (i >= count) return 2 * points.back() - points[static_cast<std::size_t>(count - 2)];
    return points[static_cast<std::size_t>(i)];
  };
  std::vector<Eigen::Vector2d> curve;
  const std::ptrdiff_t spans = closed ? count : count - 1;
  for (std::ptrdiff_t i = 0; i < spans; ++i) {
    for (int k = 0; k < kStepsPerSpan; ++k) {
      curve.push_back(
          catmull_rom({at(i - 1), at(i), at(i + 1), at(i + 2)}, static_cast<double>(k) / kStepsPerSpan));
    }
  }
  curve.push_back(at(spans));
  return curve;
}

double angle_between(double from, double to) { return std::remainder(to - from, 2 * std::numbers::pi); }

}  // namespace

std::vector<PathPoint> sample_path(const std::vector<Eigen::Vector2d>& points_m, bool closed, double step_m) {
  const std::vector<Eigen::Vector2d> points = without_repeats(points_m, closed);
  if (points.size() < 3 || !(step_m > 0)) return {};
  const std::vector<Eigen::Vector2d> curve = dense_curve(points, closed);
  std::vector<double> arc(curve.size(), 0.0);
  for (std::size_t i = 1; i < curve.size(); ++i) arc[i] = arc[i - 1] + (curve[i] - curve[i - 1]).norm();

  const double length = arc.back();
  const auto steps = static_cast<std::size_t>(std::max(3.0, std::round(length / step_m)));
  const double step = length / static_cast<double>(steps);
  const std::size_t count = closed ? steps : steps + 1;
  std::vector<Eigen::Vector2d> even;
  for (std::size_t i = 0; i < count; ++i) {
    const double s = std::min(step * static_cast<double>(i), length);
    const auto upper = std::ranges::upper_bound(arc, s);
    const std::size_t k =
        std::clamp<std::size_t>(static_cast<std::size_t>(upper - arc.begin()), 1, arc.size() - 1);
    const double u = (s - arc[k - 1]) / (arc[k] - arc[k - 1]);
    even.emplace_back((1 - u) * curve[k - 1] + u * curve[k]);
  }

  std::vector<PathPoint> path(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t before = i > 0 ? i - 1 : (closed ? count - 1 : 0);
    const std::size_t after = i + 1 < count ? i + 1 : (closed ? 0 : count - 1);
    const Eigen::Vector2d tangent = even[after] - even[before];
    path[i] = {SE2(even[i].x(), even[i].y(), std::atan2(tangent.y(), tangent.x())),
               step * static_cast<double>(i), 0};
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t before = i > 0 ? i - 1 : (closed ? count - 1 : 0);
    const std::size_t after = i + 1 < count ? i + 1 : (closed ? 0 : count - 1);
    const double turned = angle_between(path[before].map_T_path.yaw(), path[after].map_T_path.yaw());
    const double steps_between = !closed && (i == 0 || i + 1 == count) ? 1 : 2;
    path[i].curvature_1_m = turned / (steps_between * step);
  }
  return path;
}

}  // namespace waymark

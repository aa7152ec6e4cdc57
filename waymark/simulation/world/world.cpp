#include "waymark/simulation/world/world.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace waymark {
namespace {

/// Converts a vector in the map frame to the axes of the box.
Eigen::Vector3d turned(const Eigen::Vector3d& v, double cosine, double sine) {
  return {cosine * v.x() + sine * v.y(), -sine * v.x() + cosine * v.y(), v.z()};
}

}  // namespace

SE3 upright_tag(const Eigen::Vector3d& map_t_tag, double facing_rad) {
  const Eigen::Vector3d to_reader(std::cos(facing_rad), std::sin(facing_rad), 0);
  Eigen::Matrix3d map_R_tag;
  map_R_tag.col(2) = -to_reader;                                // z into the tag
  map_R_tag.col(1) = -Eigen::Vector3d::UnitZ();                 // y down
  map_R_tag.col(0) = map_R_tag.col(1).cross(map_R_tag.col(2));  // x right, as seen by its viewer
  return {SO3::from_matrix(map_R_tag), map_t_tag};
}

SE3 leaning_tag(const Eigen::Vector3d& map_t_tag, double facing_rad, double tilt_rad) {
  return upright_tag(map_t_tag, facing_rad) *
         SE3(SO3::exp(Eigen::Vector3d(-tilt_rad, 0, 0)), Eigen::Vector3d::Zero());
}

MappedTag back_of(const MappedTag& tag, double board_m) {
  MappedTag back = tag;
  back.map_T_tag = tag.map_T_tag * SE3(SO3::exp({0, std::numbers::pi, 0}), {0, 0, board_m});
  return back;
}

std::vector<TagCopy> readable_tags(const World& world) {
  std::vector<TagCopy> all;
  for (const auto& [id, tag] : world.tags.tags) all.push_back({id, tag});
  all.insert(all.end(), world.copies.begin(), world.copies.end());
  if (world.tag_board_m <= 0) return all;
  for (std::size_t i = 0, fronts = all.size(); i < fronts; ++i)
    all.push_back({all[i].tag, back_of(all[i].placed, world.tag_board_m)});
  return all;
}

Occluder as_box(const Wall& wall) {
  const Eigen::Vector2d along = wall.to_m - wall.from_m;
  const Eigen::Vector2d middle = (wall.from_m + wall.to_m) / 2;
  return {.centre_m = {middle.x(), middle.y(), wall.height_m / 2},
          .yaw_rad = std::atan2(along.y(), along.x()),
          .size_m = {along.norm(), wall.thickness_m, wall.height_m},
          .reflectance = wall.reflectance};
}

double ray_length(const Occluder& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double cosine = std::cos(box.yaw_rad);
  const double sine = std::sin(box.yaw_rad);
  const Eigen::Vector3d o = turned(origin - box.centre_m, cosine, sine);
  const Eigen::Vector3d d = turned(direction, cosine, sine);
  double enter = 0;
  double leave = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    const double half = box.size_m[axis] / 2;
    if (d[axis] == 0) {
      if (std::abs(o[axis]) > half) return kInfinity;
      continue;
    }
    const double a = (-half - o[axis]) / d[axis];
    const double b = (half - o[axis]) / d[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave ? enter : kInfinity;
}

bool line_of_sight(const World& world, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  constexpr double kMaxBlockedFraction = 0.99;
  const Eigen::Vector3d direction = to - from;
  const auto blocks = [&](const Occluder& box) {
    return ray_length(box, from, direction) < kMaxBlockedFraction;
  };
  return std::ranges::none_of(world.occluders, blocks) &&
         std::ranges::none_of(world.walls, [&](const Wall& wall) { return blocks(as_box(wall)); });
}

namespace {

/// The curve from p1 to p2 at parameter u in [0, 1].
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

/// Closely spaced points along the curve; a closed curve ends at its start.
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

namespace {

/// A rectangle in the plane, with corners in counter-clockwise order.
struct Rectangle {
  SE2 map_T_rectangle{};
  Eigen::Vector2d half_m = Eigen::Vector2d::Zero();

  [[nodiscard]] std::array<Eigen::Vector2d, 4> corners() const {
    std::array<Eigen::Vector2d, 4> points;
    constexpr std::array<std::array<double, 2>, 4> kSigns{{{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};
    for (std::size_t i = 0; i < 4; ++i)
      points[i] = map_T_rectangle * Eigen::Vector2d(kSigns[i][0] * half_m.x(), kSigns[i][1] * half_m.y());
    return points;
  }
  [[nodiscard]] double distance_m(const Eigen::Vector2d& map_p) const {
    const Eigen::Vector2d p = map_T_rectangle.inverse() * map_p;
    return (p.cwiseAbs() - half_m).cwiseMax(0).norm();
  }
};

/// Whether an edge of `a` separates the two polygons (separating axis theorem).
bool separated(const Rectangle& a, const Rectangle& b) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
  for (const Eigen::Vector2d& corner : b.corners()) {
    const Eigen::Vector2d p = a.map_T_rectangle.inverse() * corner;
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (low.array() > a.half_m.array()).any() || (high.array() < -a.half_m.array()).any();
}

double distance_m(const Rectangle& a, const Rectangle& b) {
  if (!separated(a, b) && !separated(b, a)) return 0;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector2d& corner : a.corners()) least = std::min(least, b.distance_m(corner));
  for (const Eigen::Vector2d& corner : b.corners()) least = std::min(least, a.distance_m(corner));
  return least;
}

}  // namespace

double obstacle_distance_m(const World& world, const Hull& hull, const SE2& map_T_base) {
  const SE2 base_T_middle((hull.front_m - hull.rear_m) / 2, 0, 0);
  const Rectangle body{map_T_base * base_T_middle, {(hull.front_m + hull.rear_m) / 2, hull.width_m / 2}};
  double least = std::numeric_limits<double>::infinity();
  const auto meet = [&](const Occluder& box) {
    const double bottom_m = box.centre_m.z() - box.size_m.z() / 2;
    if (bottom_m >= hull.height_m) return;
    const SE2 map_T_box(box.centre_m.x(), box.centre_m.y(), box.yaw_rad);
    least = std::min(least, distance_m(body, {map_T_box, {box.size_m.x() / 2, box.size_m.y() / 2}}));
  };
  for (const Wall& wall : world.walls) meet(as_box(wall));
  for (const Occluder& box : world.occluders) meet(box);
  return least;
}

}  // namespace waymark

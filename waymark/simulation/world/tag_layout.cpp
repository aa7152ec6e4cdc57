#include "waymark/simulation/world/tag_layout.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/sensors/tag_camera.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

constexpr double kStepMetres = 0.05;  // spacing of the points on the line
constexpr int kWantedTags = 2;        // required number of tags in view

/// A candidate position for a tag, and the points on the line from which it is visible.
struct Spot {
  MappedTag tag{};
  std::vector<std::size_t> seen_from{};
};

struct Line {
  std::vector<SE3> map_T_base{};
  std::vector<SE3> cam_T_map{};
  std::vector<Eigen::Vector3d> map_p_eye{};
};

Line line_of(const World& world, const RobotModel& robot) {
  Line line;
  for (const PathPoint& point : sample_path(world.path_m, world.path_closed, kStepMetres)) {
    line.map_T_base.push_back(lift(point.map_T_path));
    const SE3 map_T_cam = line.map_T_base.back() * robot.base_T_cam;
    line.cam_T_map.push_back(map_T_cam.inverse());
    line.map_p_eye.push_back(map_T_cam.translation());
  }
  return line;
}

bool allowed(const World& world, const RobotModel& robot, const Line& line, const MappedTag& tag,
             double clearance) {
  const Eigen::Vector2d place = tag.map_T_tag.translation().head<2>();
  if (std::ranges::any_of(world.keep_outs, [&](const KeepOut& area) { return inside(area, place); }))
    return false;
  const double far = clearance + robot.hull.front_m + robot.hull.rear_m + robot.hull.width_m + tag.size_m;
  return std::ranges::none_of(line.map_T_base, [&](const SE3& map_T_base) {
    if ((map_T_base.translation().head<2>() - place).norm() > far) return false;
    return clearance_m(robot.hull, map_T_base, tag) < clearance;
  });
}

std::vector<std::size_t> points_that_see(const World& world, const Line& line, const CameraModel& camera,
                                         const MappedTag& tag, double max_range_m) {
  std::vector<std::size_t> points;
  const Eigen::Vector3d& place = tag.map_T_tag.translation();
  for (std::size_t i = 0; i < line.cam_T_map.size(); ++i) {
    const Eigen::Vector3d cam_p_tag = line.cam_T_map[i] * place;
    if (cam_p_tag.z() <= 0 || cam_p_tag.norm() > max_range_m) continue;
    if (!visible_corners(camera, line.cam_T_map[i] * tag.map_T_tag, tag.size_m)) continue;
    if (walls_leave_open(world, line.map_p_eye[i], tag)) points.push_back(i);
  }
  return points;
}

/// Candidates to the left and right of the line, each facing points on the line some distance ahead of it.
std::vector<Spot> spots_of(const World& world, const RobotModel& robot, const CameraModel& camera,
                           const Line& line, const TagLayoutOptions& options) {
  constexpr std::size_t kEvery = 4;  // in points
  std::vector<Spot> places;
  const std::size_t count = line.map_T_base.size();
  for (std::size_t i = 0; i < count; i += kEvery) {
    for (const double side : {-1.4, -1.1, -0.8, -0.6, 0.6, 0.8, 1.1, 1.4}) {
      const Eigen::Vector3d beside = line.map_T_base[i] * Eigen::Vector3d(0, side, options.height_m);
      for (const double before_m : {0.8, 1.4, 2.0}) {
        const auto before = static_cast<std::size_t>(before_m / kStepMetres);
        if (!world.path_closed && before > i) continue;
        const Eigen::Vector3d reader = line.map_T_base[(i + count - before % count) % count].translation();
        Spot place{.tag = {.map_T_tag = upright_tag(
                               beside, std::atan2(reader.y() - beside.y(), reader.x() - beside.x())),
                           .size_m = options.tag_size_m}};
        if (!allowed(world, robot, line, place.tag, options.clearance_m)) continue;
        place.seen_from = points_that_see(world, line, camera, place.tag, options.max_range_m);
        if (!place.seen_from.empty()) places.push_back(std::move(place));
      }
    }
  }
  return places;
}

/// Whether the paper of one candidate hides the tag of another from a point that would otherwise see it.
bool hides_from_line(const Line& line, const Screen& paper, const Spot& spot) {
  const double reach_m = std::hypot(paper.half_width_m, paper.half_height_m) + spot.tag.size_m;
  const Eigen::Vector3d middle = paper.screen_T_map.inverse().translation();
  const Eigen::Vector3d& tag = spot.tag.map_T_tag.translation();
  return std::ranges::any_of(spot.seen_from, [&](std::size_t p) {
    const Eigen::Vector3d& eye = line.map_p_eye[p];
    const Eigen::Vector3d ray = tag - eye;
    const double along = std::clamp((middle - eye).dot(ray) / ray.squaredNorm(), 0.0, 1.0);
    return (eye + along * ray - middle).norm() < reach_m && hides(paper, eye, spot.tag);
  });
}

/// Whether both tags are visible from every point from which either one would be visible alone.
bool are_compatible(const Line& line, const Spot& a, const Screen& paper_a, const Spot& b,
                    const Screen& paper_b) {
  const double apart = (a.tag.map_T_tag.translation() - b.tag.map_T_tag.translation()).norm();
  return apart >= 2 * std::max(a.tag.size_m, b.tag.size_m) && !hides_from_line(line, paper_a, b) &&
         !hides_from_line(line, paper_b, a);
}

/// Indices of the selected candidates, in order. Each step selects the candidate that covers the most points
/// that still need a tag, and that neither hides a selected tag nor is hidden by one.
std::vector<std::size_t> cover(const std::vector<Spot>& places, const Line& line, const World& world,
                               int most) {
  std::vector<int> wants(line.map_T_base.size(), kWantedTags);
  std::vector<Screen> papers;
  for (const Spot& place : places)
    papers.push_back(paper_of(world.anchor, place.tag, world.tag_margin_cells));
  std::vector<char> free(places.size(), 1);
  std::vector<std::size_t> taken;
  while (static_cast<int>(taken.size()) < most) {
    std::size_t best = places.size();
    std::ptrdiff_t best_gain = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (free[i] == 0) continue;
      const auto gain =
          std::ranges::count_if(places[i].seen_from, [&](std::size_t p) { return wants[p] > 0; });
      if (gain <= best_gain) continue;
      best = i;
      best_gain = gain;
    }
    if (best == places.size()) break;
    taken.push_back(best);
    for (const std::size_t p : places[best].seen_from) --wants[p];
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (free[i] != 0 && !are_compatible(line, places[i], papers[i], places[best], papers[best]))
        free[i] = 0;
    }
  }
  return taken;
}

}  // namespace

bool inside(const KeepOut& area, const Eigen::Vector2d& p) {
  bool in = false;
  for (std::size_t i = 0, k = area.corners_m.size() - 1; i < area.corners_m.size(); k = i++) {
    const Eigen::Vector2d& a = area.corners_m[i];
    const Eigen::Vector2d& b = area.corners_m[k];
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if (p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y())) in = !in;
  }
  return in;
}

Result<World> lay_tags(World world, const RobotModel& robot, const CameraModel& camera,
                       const TagLayoutOptions& options) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  const Line line = line_of(world, robot);
  if (line.map_T_base.size() < 3)
    return fail(ErrorCode::InvalidArgument, "the world has no line to drive", {.source = world.name},
                "Set `path_m` to at least three distinct points.");
  const std::vector<Spot> places = spots_of(world, robot, camera, line, options);
  std::vector<std::size_t> taken = cover(places, line, world, options.most_tags);
  if (taken.empty())
    return fail(ErrorCode::InvalidArgument, "no position for a tag along the line", {.source = world.name},
                "Reduce `clearance_m` or `tag_size_m`.");
  // Tags are numbered in order along the line.
  std::ranges::sort(taken, {}, [&](std::size_t i) { return places[i].seen_from.front(); });
  const FamilyId family = world.anchor.family;
  world.tags.tags.clear();
  for (std::size_t i = 0; i < taken.size(); ++i)
    world.tags.tags[{family, static_cast<int>(i)}] = places[taken[i]].tag;
  world.anchor = {family, 0};
  return world;
}

}  // namespace waymark

#include "waymark/simulation/world/world_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "waymark/base/angles.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/simulation/sensors/tag_camera.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

constexpr double kCheckStepMetres = 0.02;

/// Tags and screens to be tested from each point.
struct View {
  const World& world;
  const CameraModel& camera;
  double max_range_m = 0;
  std::vector<TagCopy> tags{};
  std::vector<Screen> screens{};
};

/// Number of points on the line from which one tag hides another.
using HidingPoints = std::map<std::pair<TagId, TagId>, std::size_t>;

std::size_t tags_in_view(const View& view, const SE3& map_T_cam, HidingPoints& hiding) {
  const SE3 cam_T_map = map_T_cam.inverse();
  const Eigen::Vector3d& eye = map_T_cam.translation();
  std::size_t seen = 0;
  for (const TagCopy& tag : view.tags) {
    if ((tag.placed.map_T_tag.translation() - eye).norm() > view.max_range_m) continue;
    if (!visible_corners(view.camera, cam_T_map * tag.placed.map_T_tag, tag.placed.size_m)) continue;
    if (!walls_leave_open(view.world, eye, tag.placed)) continue;
    const Screen* screen = hiding_screen(view.screens, eye, tag.placed);
    if (screen == nullptr || view.world.corners_through_paper) ++seen;
    if (screen != nullptr && screen->tag) ++hiding[{tag.tag, *screen->tag}];
  }
  return seen;
}

std::vector<std::pair<TagId, TagId>> overlapping_tags(World world) {
  world.tag_board_m = 0;  // here the back of a tag is not a separate tag
  const std::vector<TagCopy> tags = readable_tags(world);
  std::vector<std::pair<TagId, TagId>> pairs;
  for (std::size_t i = 0; i < tags.size(); ++i) {
    for (std::size_t k = i + 1; k < tags.size(); ++k) {
      if (overlap(tags[i], tags[k])) pairs.emplace_back(tags[i].tag, tags[k].tag);
    }
  }
  return pairs;
}

}  // namespace

Result<WorldCheck> check_world(const World& world, const RobotModel& robot, const CameraModel& camera,
                               const TagCameraOptions& options) {
  const auto path = sample_path(world.path_m, world.path_closed, kCheckStepMetres);
  if (path.size() < 3)
    return fail(ErrorCode::InvalidArgument, "the world has no line to drive", {.source = world.name},
                "Set `path_m` to at least three distinct points.");
  WorldCheck check{.lap_m = path.back().arc_length_m + (world.path_closed ? path[1].arc_length_m : 0),
                   .min_clearance_m = std::numeric_limits<double>::infinity(),
                   .fewest_tags = world.tags.tags.size(),
                   .overlapping = overlapping_tags(world)};
  const View view{world, camera, options.max_range_m, readable_tags(world), screens_of(world)};
  HidingPoints hiding;
  std::size_t with_two = 0;
  std::size_t with_one = 0;
  for (const PathPoint& point : path) {
    const SE3 map_T_base = lift(point.map_T_path);
    const std::size_t seen = tags_in_view(view, map_T_base * robot.base_T_cam, hiding);
    with_two += seen >= 2 ? 1 : 0;
    with_one += seen >= 1 ? 1 : 0;
    check.fewest_tags = std::min(check.fewest_tags, seen);
    check.sharpest_left_1_m = std::max(check.sharpest_left_1_m, point.curvature_1_m);
    check.sharpest_right_1_m = std::max(check.sharpest_right_1_m, -point.curvature_1_m);
    for (const auto& [tag, mapped] : world.tags.tags) {
      const double clearance = clearance_m(robot.hull, map_T_base, mapped);
      if (clearance >= check.min_clearance_m) continue;
      check.min_clearance_m = clearance;
      check.nearest_tag = tag;
      check.nearest_place_m = point.map_T_path.translation();
    }
  }
  for (const auto& [tags, points] : hiding)
    check.hidden.push_back({tags.first, tags.second, kCheckStepMetres * static_cast<double>(points)});
  check.two_tags_fraction = static_cast<double>(with_two) / static_cast<double>(path.size());
  check.one_tag_fraction = static_cast<double>(with_one) / static_cast<double>(path.size());
  return check;
}

namespace {

/// A camera at `map_p` facing `map_target`, with a level x axis.
SE3 looking_at(const Eigen::Vector3d& map_p, const Eigen::Vector3d& map_target) {
  Eigen::Matrix3d map_R_cam;
  map_R_cam.col(2) = (map_target - map_p).normalized();
  map_R_cam.col(0) = map_R_cam.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
  map_R_cam.col(1) = map_R_cam.col(2).cross(map_R_cam.col(0));
  return {SO3::from_matrix(map_R_cam), map_p};
}

void place_camera(const World& world, int steps, OrbitReport& report) {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const auto& [id, tag] : world.tags.tags) center += tag.map_T_tag.translation();
  center /= static_cast<double>(world.tags.tags.size());
  double farthest = 0.5;
  for (const auto& [id, tag] : world.tags.tags)
    farthest = std::max(farthest, (tag.map_T_tag.translation() - center).norm());
  report.map_t_center = center;
  report.radius_m = 1.25 * farthest;
  for (int i = 0; i < steps; ++i) {
    const double angle = 2 * std::numbers::pi * i / steps;
    const Eigen::Vector3d p = center + report.radius_m * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    report.map_T_cam.push_back(looking_at(p, center));
  }
}

double off_identity(const SE3& product) { return product.log().norm(); }

/// Maximum error over all closed chains of transforms.
double closure_of(const World& world, const std::vector<SE3>& map_T_cam) {
  const SE3& map_T_anchor = world.tags.find(world.anchor)->map_T_tag;
  double worst = 0;
  SE3 round_the_circle;
  for (std::size_t i = 0; i < map_T_cam.size(); ++i) {
    const SE3 cam_T_map = map_T_cam[i].inverse();
    const SE3 cam_T_anchor = cam_T_map * map_T_anchor;
    const SE3 through_anchor = map_T_anchor * cam_T_anchor.inverse();  // equation 3.1
    worst = std::max(worst, off_identity(cam_T_map * through_anchor));
    SE3 along_the_tags;  // from each tag to the next through the camera, then back to the first
    std::optional<SE3> first_T_cam;
    std::optional<SE3> last_T_cam;
    for (const auto& [id, tag] : world.tags.tags) {
      const SE3 cam_T_tag = cam_T_map * tag.map_T_tag;
      worst = std::max(worst, off_identity(tag.map_T_tag.inverse() * (through_anchor * cam_T_tag)));
      if (last_T_cam) along_the_tags = along_the_tags * (*last_T_cam * cam_T_tag);
      last_T_cam = cam_T_tag.inverse();
      if (!first_T_cam) first_T_cam = last_T_cam;
    }
    worst = std::max(worst, off_identity(along_the_tags * (*last_T_cam * first_T_cam->inverse())));
    round_the_circle = round_the_circle * (cam_T_map * map_T_cam[(i + 1) % map_T_cam.size()]);
  }
  return std::max(worst, off_identity(round_the_circle));
}

/// Compares the motion between consecutive composed frames with the nominal motion.
class Watch {
 public:
  explicit Watch(OrbitReport& report) : report_(report) {}

  void see(const SE3& nominal, const SE3& composed) {
    for (int axis = 0; axis < 3; ++axis) {
      const double cosine = nominal.rotation().matrix().col(axis).dot(composed.rotation().matrix().col(axis));
      report_.smallest_axis_cosine = std::min(report_.smallest_axis_cosine, cosine);
    }
    if (last_) {
      const SE3 moved = last_->composed.inverse() * composed;
      const SE3 meant = last_->nominal.inverse() * nominal;
      const SE3 jump = meant.inverse() * moved;
      report_.jump_m = std::max(report_.jump_m, jump.translation().norm());
      report_.jump_deg = std::max(report_.jump_deg, to_degrees(jump.rotation().angle()));
    }
    last_ = Last{nominal, composed};
  }

 private:
  struct Last {
    SE3 nominal, composed;
  };
  OrbitReport& report_;
  std::optional<Last> last_;
};

SE3 disturbed(const SE3& a_T_b, const OrbitOptions& options, Random& random) {
  SE3::Tangent xi;
  for (int i = 0; i < 3; ++i) xi[i] = random.normal(0, options.sigma_m);
  for (int i = 3; i < 6; ++i) xi[i] = random.normal(0, to_radians(options.sigma_deg));
  return a_T_b * SE3::exp(xi);
}

void disturb(const World& world, const OrbitOptions& options, OrbitReport& report) {
  Random random(options.seed);
  const SE3& map_T_anchor = world.tags.find(world.anchor)->map_T_tag;
  Watch camera(report);
  std::map<TagId, Watch> watches;
  report.tags_composed = world.tags;
  for (const SE3& map_T_cam : report.map_T_cam) {
    const SE3 cam_T_map = disturbed(map_T_cam, options, random).inverse();
    const SE3 cam_T_anchor = cam_T_map * disturbed(map_T_anchor, options, random);
    const SE3 through_anchor = map_T_anchor * cam_T_anchor.inverse();
    report.map_T_cam_composed.push_back(through_anchor);
    camera.see(map_T_cam, through_anchor);
    for (auto& [id, tag] : report.tags_composed.tags) {
      const SE3& nominal = world.tags.find(id)->map_T_tag;
      tag.map_T_tag = through_anchor * (cam_T_map * disturbed(nominal, options, random));
      watches.try_emplace(id, report).first->second.see(nominal, tag.map_T_tag);
    }
  }
  // A jump involves two frames of two disturbed poses each. A rotation at one end moves the other end by an
  // amount proportional to the distance between them, which is at most the diameter. The limit is six
  // standard deviations of the length of a three-dimensional vector.
  const double turn = to_radians(options.sigma_deg);
  const double lever_m = 2 * report.radius_m;
  const double sigma_m = std::hypot(std::numbers::sqrt2 * options.sigma_m, turn * lever_m);
  constexpr double kSix = 6 * std::numbers::sqrt2 * std::numbers::sqrt3;
  report.jump_limit_m = kSix * sigma_m + 1e-9;
  report.jump_limit_deg = kSix * std::numbers::sqrt2 * options.sigma_deg + 1e-7;
}

}  // namespace

Result<OrbitReport> orbit(const World& world, const OrbitOptions& options) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  if (world.tags.find(world.anchor) == nullptr)
    return fail(ErrorCode::InvalidArgument, "the world has no anchor for the orbit", {.source = world.name});
  OrbitReport report;
  place_camera(world, options.steps, report);
  report.closure = closure_of(world, report.map_T_cam);
  disturb(world, options, report);
  return report;
}

}  // namespace waymark

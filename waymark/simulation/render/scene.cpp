#include "waymark/simulation/render/scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr double kPaper = 1.0;

int texture_index(const std::string& name) {
  const auto* found = std::find(kFloorTextures.begin(), kFloorTextures.end(), name);
  return found == kFloorTextures.end() ? 0 : static_cast<int>(found - kFloorTextures.begin());
}

constexpr int kSpeckle = 3;

/// Bounding box of the world.
struct Extent {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d high = -low;

  void add(const Eigen::Vector3d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
};

/// Pose of an upright or horizontal face, with axes as seen by its viewer.
SE3 face(const Eigen::Vector3d& centre, const Eigen::Vector3d& to_reader, const Eigen::Vector3d& down) {
  Eigen::Matrix3d map_R;
  map_R.col(2) = -to_reader;
  map_R.col(1) = down;
  map_R.col(0) = map_R.col(1).cross(map_R.col(2));
  return {SO3::from_matrix(map_R), centre};
}

/// The five visible faces of a box, plus its underside if it is above the floor.
void add_box(const SE3& map_T_box, const Eigen::Vector3d& size, const Finish& finish, Scene& scene) {
  const auto add = [&](const Eigen::Vector3d& outwards, const Eigen::Vector3d& down) {
    const Eigen::Vector3d side = down.cross(outwards).cwiseAbs();
    const SE3 box_T_face = face(outwards.cwiseProduct(size) / 2, outwards, down);
    scene.surfaces.push_back(
        plain_surface(map_T_box * box_T_face, side.dot(size), down.cwiseAbs().dot(size), finish));
  };
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  for (const Eigen::Vector3d& outwards : {x, Eigen::Vector3d(-x), y, Eigen::Vector3d(-y)}) add(outwards, -z);
  add(z, -x);
  add(-z, -x);
}

void add_occluder(const Occluder& box, Scene& scene) {
  if (box.size_m.minCoeff() <= 0) return;
  const SE3 map_T_box(SO3::from_rpy(0, 0, box.yaw_rad), box.centre_m);
  add_box(map_T_box, box.size_m, {.reflectance = box.reflectance}, scene);
}

void add_panel(const Panel& panel, Scene& scene) {
  if (panel.width_m <= 0 || panel.height_m <= 0) return;
  Finish finish{.reflectance = panel.reflectance};
  const double thickness = std::max(panel.thickness_m, 1e-3);
  const SE3 map_T_box = panel.map_T_panel * SE3(SO3(), {0, 0, thickness / 2});
  add_box(map_T_box, {panel.width_m, panel.height_m, thickness}, finish, scene);
}

Extent extent_of(const World& world) {
  Extent extent;
  for (const auto& [id, tag] : world.tags.tags) extent.add(tag.map_T_tag.translation());
  for (const Eigen::Vector2d& p : world.path_m) extent.add({p.x(), p.y(), 0});
  for (const Wall& wall : world.walls) {
    extent.add({wall.from_m.x(), wall.from_m.y(), wall.height_m});
    extent.add({wall.to_m.x(), wall.to_m.y(), wall.height_m});
  }
  for (const Occluder& box : world.occluders) extent.add(box.centre_m + box.size_m / 2);
  extent.add(Eigen::Vector3d::Zero());
  return extent;
}

/// Floor, walls and ceiling, visible from the inside.
void add_room(const World& world, const SceneOptions& options, Scene& scene) {
  const Extent extent = extent_of(world);
  const bool closed = options.room_height_m > 0;
  const double margin = closed ? options.room_margin_m : 20;
  const Eigen::Vector2d low = extent.low.head<2>().array() - margin;
  const Eigen::Vector2d high = extent.high.head<2>().array() + margin;
  const Eigen::Vector2d middle = (low + high) / 2;
  const Eigen::Vector2d size = high - low;
  const double height = std::max(options.room_height_m, extent.high.z() + 0.1);
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const Finish floor{.reflectance = world.floor.reflectance,
                     .contrast = world.floor.contrast,
                     .texture = texture_index(world.floor.texture),
                     .cell_m = world.floor.cell_m};
  scene.map_t_lamp = {middle.x(), middle.y(), height - 0.1};
  const auto at = [&](double px, double py, double pz) { return Eigen::Vector3d(px, py, pz); };
  scene.surfaces.push_back(
      plain_surface(face(at(middle.x(), middle.y(), 0), z, -x), size.y(), size.x(), floor));
  if (!closed) return;
  const Finish wall{.reflectance = options.wall_reflectance,
                    .contrast = options.wall_contrast,
                    .texture = kSpeckle,
                    .cell_m = 1.0};
  const double h = height / 2;
  scene.surfaces.push_back(
      plain_surface(face(at(middle.x(), middle.y(), height), -z, -x), size.y(), size.x(), wall));
  scene.surfaces.push_back(plain_surface(face(at(low.x(), middle.y(), h), x, -z), size.y(), height, wall));
  scene.surfaces.push_back(plain_surface(face(at(high.x(), middle.y(), h), -x, -z), size.y(), height, wall));
  scene.surfaces.push_back(plain_surface(face(at(middle.x(), low.y(), h), y, -z), size.x(), height, wall));
  scene.surfaces.push_back(plain_surface(face(at(middle.x(), high.y(), h), -y, -z), size.x(), height, wall));
}

Status check_surface(const SceneSurface& surface, std::size_t index) {
  const auto bad = [&](std::string what) {
    return fail(ErrorCode::InvalidArgument, std::move(what), {.key = fmt::format("surfaces[{}]", index)});
  };
  if (!surface.map_T_surface.matrix().allFinite()) return bad("non-finite pose");
  const bool has_size = std::isfinite(surface.width_m) && std::isfinite(surface.height_m) &&
                        surface.width_m > 0 && surface.height_m > 0;
  if (!has_size) return bad(fmt::format("invalid size {} m x {} m", surface.width_m, surface.height_m));
  const Finish& finish = surface.finish;
  const bool looks = finish.reflectance >= 0 && finish.contrast >= 0 && finish.gloss >= 0 &&
                     finish.cell_m > 0 && finish.texture >= 0 &&
                     finish.texture < static_cast<int>(kFloorTextures.size()) &&
                     std::isfinite(finish.reflectance + finish.contrast + finish.gloss + finish.cell_m);
  if (!looks) return bad("invalid finish: a value is out of range");
  if (!surface.tag) return {};
  const Family& tags = family(surface.tag->family);
  if (surface.tag->number < 0 || static_cast<std::size_t>(surface.tag->number) >= tags.codes.size())
    return bad(fmt::format("{} has no tag {}", tags.name, surface.tag->number));
  const double total_m = surface.tag_size_m / tags.width_at_border * tags.total_width;
  const double paper_m = std::min(surface.width_m, surface.height_m) * (1 + 1e-9);
  if (!(surface.tag_size_m > 0) || total_m > paper_m)
    return bad(fmt::format("a tag of {} m does not fit on its paper", surface.tag_size_m));
  return {};
}

}  // namespace

SceneSurface plain_surface(const SE3& map_T_surface, double width_m, double height_m, const Finish& finish) {
  return {.map_T_surface = map_T_surface, .width_m = width_m, .height_m = height_m, .finish = finish};
}

SceneSurface tag_surface(const TagId& tag, const SE3& map_T_tag, double size_m, double margin_cells) {
  const Family& tags = family(tag.family);
  const double side_m = size_m / tags.width_at_border * (tags.total_width + 2 * margin_cells);
  return {.map_T_surface = map_T_tag,
          .width_m = side_m,
          .height_m = side_m,
          .finish = {.reflectance = kPaper, .two_sided = true},
          .tag = tag,
          .tag_size_m = size_m};
}

Scene scene_of(const World& world, const SceneOptions& options) {
  Scene scene;
  add_room(world, options, scene);
  for (const Wall& wall : world.walls) add_occluder(as_box(wall), scene);
  for (const Occluder& box : world.occluders) add_occluder(box, scene);
  for (const Panel& panel : world.panels) add_panel(panel, scene);
  for (const TagCopy& tag : readable_tags(world)) {
    scene.surfaces.push_back(
        tag_surface(tag.tag, tag.placed.map_T_tag, tag.placed.size_m, world.tag_margin_cells));
    scene.surfaces.back().finish.gloss = options.ink_gloss;
  }
  return scene;
}

Status check(const Scene& scene) {
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    if (Status good = check_surface(scene.surfaces[i], i); !good) return good;
  }
  const bool finite = scene.map_t_lamp.allFinite() && std::isfinite(scene.sky_reflectance);
  if (!finite) return fail(ErrorCode::InvalidArgument, "non-finite lamp or sky", {.key = "scene"});
  return {};
}

}  // namespace waymark

// From what a world in SDF shows to a world of ours: world_of().
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "waymark/app/world/import_world.hpp"
#include "waymark/app/world/sdf_tags.hpp"
#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

using Vec3 = Eigen::Vector3d;

/// Whether the second is what the first one's board shows on its back.
std::optional<double> board_between(const MappedTag& front, const MappedTag& back) {
  const SE3 front_T_back = front.map_T_tag.inverse() * back.map_T_tag;
  const Vec3& t = front_T_back.translation();
  const bool opposite = (front_T_back.rotation() * Vec3::UnitZ()).z() < -0.999;
  constexpr double kThickest_m = 0.1;
  const bool behind = t.z() > 0 && t.z() < kThickest_m && t.head<2>().norm() < 0.1 * front.size_m;
  return opposite && behind ? std::optional(t.z()) : std::nullopt;
}

FamilyId most_common_family(const std::vector<PaintedTag>& tags) {
  std::map<FamilyId, int> counts;
  for (const PaintedTag& tag : tags) ++counts[tag.tag.family];
  return std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; })->first;
}

double rounded(double value, double step) { return std::round(value / step) * step; }

void take_tags(const std::vector<PaintedTag>& painted, World& world, std::vector<std::string>& warnings) {
  const FamilyId family = most_common_family(painted);
  std::vector<double> boards_m;
  double margin_cells = 1e9;
  for (const PaintedTag& tag : painted) {
    if (tag.tag.family != family) {
      warnings.push_back(fmt::format("{} is left out: a world has tags of one family", to_string(tag.tag)));
      continue;
    }
    MappedTag placed = tag.placed;
    constexpr double kTenthOfAMillimetre = 1e-4;
    placed.size_m = rounded(placed.size_m, kTenthOfAMillimetre);
    margin_cells = std::min(margin_cells, tag.margin_cells);
    const auto [known, fresh] = world.tags.tags.emplace(tag.tag, placed);
    if (fresh) continue;
    if (const auto board_m = board_between(known->second, placed))
      boards_m.push_back(*board_m);
    else
      warnings.push_back(
          fmt::format("{} is there more than once; the first place counts", to_string(tag.tag)));
  }
  world.anchor = world.tags.tags.begin()->first;
  world.tag_margin_cells = std::max(0.0, rounded(margin_cells, 0.05));
  if (boards_m.empty()) return;
  std::ranges::nth_element(boards_m, boards_m.begin() + static_cast<std::ptrdiff_t>(boards_m.size() / 2));
  world.tag_board_m = rounded(boards_m[boards_m.size() / 2], 1e-4);
  if (boards_m.size() < world.tags.tags.size())
    warnings.push_back(
        fmt::format("{} of {} tags are on the back of their boards as well; all are taken as such",
                    boards_m.size(), world.tags.tags.size()));
}

/// The box with a vertical axis: the shape's own, turned about z; else the one along the axes around it.
Occluder upright_box(const SdfVisual& visual, bool& exact) {
  const Eigen::Matrix3d R = visual.world_T_visual.rotation().matrix();
  Occluder box{.centre_m = visual.world_T_visual * visual.visual_t_centre, .reflectance = visual.reflectance};
  exact = visual.shape == SdfShape::Box;
  for (int up = 0; up < 3; ++up) {
    constexpr double kVertical = 0.9998;  // within a degree
    if (std::abs(R(2, up)) < kVertical) continue;
    const int along = (up + 1) % 3, across = (up + 2) % 3;
    box.yaw_rad = std::atan2(R(1, along), R(0, along));
    box.size_m = {visual.size_m[along], visual.size_m[across], visual.size_m[up]};
    if (visual.shape == SdfShape::Cylinder) exact = false;
    return box;
  }
  exact = false;
  box.size_m = R.cwiseAbs() * visual.size_m;
  return box;
}

/// The board that carries a tag and nothing else.
bool carries_a_tag(const SdfVisual& visual, const World& world) {
  constexpr double kThin_m = 0.05;
  if (visual.size_m.minCoeff() > kThin_m) return false;
  const Vec3 middle = visual.world_T_visual * visual.visual_t_centre;
  return std::ranges::any_of(world.tags.tags, [&](const auto& entry) {
    return (entry.second.map_T_tag.translation() - middle).norm() < kThin_m + world.tag_board_m &&
           visual.size_m.maxCoeff() < 3 * entry.second.size_m;
  });
}

void take_scenery(const SdfScene& scene, World& world, std::vector<std::string>& warnings) {
  std::set<std::string> moving;
  int around = 0;
  for (const SdfVisual& visual : scene.visuals) {
    if (!visual.fixed) {
      moving.insert(visual.name.substr(0, visual.name.find("::")));
      continue;
    }
    const Vec3 up = visual.world_T_visual.rotation() * visual.visual_n_plane;
    if (visual.shape == SdfShape::Plane && up.z() > 0.999 && visual.texture.empty())
      world.floor.reflectance = visual.reflectance;
    if (visual.shape == SdfShape::Plane || carries_a_tag(visual, world)) continue;
    constexpr double kLeast_m = 1e-3;
    constexpr double kMost_m = 1000;
    bool exact = false;
    Occluder box = upright_box(visual, exact);
    if (box.size_m.minCoeff() < kLeast_m || box.size_m.maxCoeff() > kMost_m) {
      warnings.push_back(fmt::format(
          "{} is left out: its shape is not known, or its size is not between 1 mm and 1 km", visual.name));
      continue;
    }
    if (box.centre_m.z() + box.size_m.z() / 2 < 0.01) continue;  // a part of the floor
    if (!exact) ++around;
    world.occluders.push_back(box);
  }
  if (around > 0)
    warnings.push_back(
        fmt::format("{} shapes that are no upright boxes count as the boxes around them", around));
  for (const std::string& model : moving)
    warnings.push_back(fmt::format("{} is left out: it is not static", model));
}

}  // namespace

Result<World> world_of(const SdfScene& scene, const std::vector<std::string>& families,
                       std::vector<std::string>& warnings) {
  const auto painted = find_painted_tags(scene, families);
  if (!painted) return tl::unexpected(painted.error());
  warnings.insert(warnings.end(), painted->warnings.begin(), painted->warnings.end());
  if (painted->tags.empty())
    return fail(
        ErrorCode::NotFound,
        fmt::format("no texture shows a tag that can be read ({} of {} visuals have a texture)",
                    std::ranges::count_if(scene.visuals, [](const auto& v) { return !v.texture.empty(); }),
                    scene.visuals.size()),
        {}, "Name the families of the tags with --family, and folders of models with --models.");
  World world{.name = scene.name};
  take_tags(painted->tags, world, warnings);
  take_scenery(scene, world, warnings);
  return world;
}

}  // namespace waymark

#include "waymark/config/world_scenery.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/yaml_numbers.hpp"

namespace waymark::internal {
namespace {

/// Reads every entry of a list that may be missing.
template <class Read>
Status each(const YamlCursor& root, std::string_view key, Read&& read) {
  const auto list = root.find(key);
  if (!list) return {};
  for (const YamlCursor& entry : list->children()) {
    if (Status status = read(entry); !status) return status;
  }
  return {};
}

Status read_wall(const YamlCursor& entry, World& world) {
  Status status = entry.check_keys({"from_m", "to_m", "height_m", "thickness_m", "reflectance"});
  if (!status) return status;
  const auto from = entry.read_at("from_m", &read_point);
  const auto to = entry.read_at("to_m", &read_point);
  if (!from) return tl::unexpected(from.error());
  if (!to) return tl::unexpected(to.error());
  if (!((*to - *from).norm() > 1e-6))
    return entry.fail_here(ErrorCode::InvalidArgument, "a wall without length");
  Wall wall{.from_m = *from, .to_m = *to};
  Numbers value(entry);
  wall.height_m = value.optional_positive("height_m", wall.height_m);
  wall.thickness_m = value.optional_positive("thickness_m", wall.thickness_m);
  wall.reflectance = value.optional_within("reflectance", wall.reflectance, 0, 1);
  world.walls.push_back(wall);
  return value.status();
}

Status read_occluder(const YamlCursor& entry, World& world) {
  Status status =
      entry.check_keys({"x_m", "y_m", "z_m", "yaw_deg", "length_m", "width_m", "height_m", "reflectance"});
  if (!status) return status;
  Numbers value(entry);
  Occluder box{.centre_m = {value("x_m"), value("y_m"), 0},
               .yaw_rad = to_radians(value.optional("yaw_deg", 0)),
               .size_m = {value.positive("length_m"), value.positive("width_m"), value.positive("height_m")}};
  box.centre_m.z() = value.optional("z_m", box.size_m.z() / 2);
  box.reflectance = value.optional_within("reflectance", box.reflectance, 0, 1);
  world.occluders.push_back(box);
  return value.status();
}

Status read_keep_out(const YamlCursor& entry, World& world) {
  KeepOut area;
  for (const YamlCursor& point : entry.children()) {
    const auto corner = read_point(point);
    if (!corner) return tl::unexpected(corner.error());
    area.corners_m.push_back(*corner);
  }
  if (area.corners_m.size() < 3)
    return entry.fail_here(ErrorCode::InvalidArgument, "an area needs three corners or more");
  world.keep_outs.push_back(std::move(area));
  return {};
}

Status read_floor(const YamlCursor& root, Floor& floor) {
  const auto entry = root.find("floor");
  if (!entry) return {};
  Status status = entry->check_keys({"texture", "reflectance", "contrast", "cell_m"});
  if (!status) return status;
  if (entry->find("texture")) {
    const auto texture = entry->read_at("texture", &YamlCursor::text);
    if (!texture) return tl::unexpected(texture.error());
    if (std::ranges::find(kFloorTextures, *texture) == kFloorTextures.end())
      return entry->at("texture")->fail_here(
          ErrorCode::InvalidArgument, fmt::format("there is no floor '{}'", *texture),
          suggestion(*texture, {kFloorTextures.begin(), kFloorTextures.end()}));
    floor.texture = *texture;
  }
  Numbers value(*entry);
  floor.reflectance = value.optional_within("reflectance", floor.reflectance, 0, 1);
  floor.contrast = value.optional_within("contrast", floor.contrast, 0, 1);
  floor.cell_m = value.optional_positive("cell_m", floor.cell_m);
  return value.status();
}

Status read_panel_tag(const YamlCursor& entry, FamilyId family, double size_m, World& world) {
  Status status = entry.check_keys({"id", "right_m", "up_m", "size_m"});
  if (!status) return status;
  Panel& panel = world.panels.back();
  Numbers value(entry);
  const Eigen::Vector3d panel_t_tag(value.optional("right_m", 0), -value.optional("up_m", 0), 0);
  const double size = value.optional_positive("size_m", size_m);
  if (!value.status()) return value.status();
  const auto tag = place_tag(entry, family, panel.map_T_panel * SE3(SO3(), panel_t_tag), size, world);
  if (!tag) return tl::unexpected(tag.error());
  panel.tags.push_back(*tag);
  return {};
}

Status read_panel(const YamlCursor& entry, FamilyId family, double size_m, World& world) {
  Status status = entry.check_keys({"x_m", "y_m", "z_m", "facing_deg", "tilt_deg", "width_m", "height_m",
                                    "thickness_m", "reflectance", "tags"});
  if (!status) return status;
  Numbers value(entry);
  Panel panel{
      .map_T_panel = leaning_tag({value("x_m"), value("y_m"), value("z_m")}, to_radians(value("facing_deg")),
                                 to_radians(value.optional("tilt_deg", 0))),
      .width_m = value.positive("width_m"),
      .height_m = value.positive("height_m")};
  panel.thickness_m = value.optional_positive("thickness_m", panel.thickness_m);
  panel.reflectance = value.optional_within("reflectance", panel.reflectance, 0, 1);
  if (!value.status()) return value.status();
  world.panels.push_back(std::move(panel));
  return each(entry, "tags",
              [&](const YamlCursor& tag) { return read_panel_tag(tag, family, size_m, world); });
}

}  // namespace

Result<Eigen::Vector2d> read_point(const YamlCursor& point) {
  const std::vector<YamlCursor> xy = point.children();
  if (xy.size() != 2)
    return point.fail_here(ErrorCode::InvalidArgument, "is not a point", "Write [x, y] in metres.");
  const Result<double> x = xy[0].number();
  const Result<double> y = xy[1].number();
  if (!x) return tl::unexpected(x.error());
  if (!y) return tl::unexpected(y.error());
  if (Status status = check_proportion(point, std::vector{*x, *y}); !status)
    return tl::unexpected(status.error());
  return Eigen::Vector2d(*x, *y);
}

Result<TagId> place_tag(const YamlCursor& entry, FamilyId family_id, const SE3& map_T_tag, double size_m,
                        World& world) {
  const auto most = static_cast<std::int64_t>(family(family_id).codes.size()) - 1;
  const Result<YamlCursor> id = entry.at("id");
  if (!id) return tl::unexpected(id.error());
  const Result<std::int64_t> number = id->integer(0, most);
  if (!number) return tl::unexpected(number.error());
  const TagId tag{family_id, static_cast<int>(*number)};
  if (!world.tags.tags.emplace(tag, MappedTag{.map_T_tag = map_T_tag, .size_m = size_m}).second)
    return id->fail_here(ErrorCode::InvalidArgument, fmt::format("{} is given twice", to_string(tag)));
  return tag;
}

Status read_scenery(const YamlCursor& root, FamilyId family, double size_m, World& world) {
  Numbers value(root);
  world.tag_margin_cells = value.optional_within("tag_margin_cells", world.tag_margin_cells, 0, 20);
  world.tag_board_m = value.optional_within("two_sided_board_m", world.tag_board_m, 0, 1);
  Status status = value.status();
  if (const auto through = root.find("corners_through_paper"); status && through) {
    const Result<bool> told = through->boolean();
    if (!told) return tl::unexpected(told.error());
    world.corners_through_paper = *told;
  }
  if (status)
    status = each(root, "panels",
                  [&](const YamlCursor& entry) { return read_panel(entry, family, size_m, world); });
  if (status) status = each(root, "walls", [&](const auto& entry) { return read_wall(entry, world); });
  if (status)
    status = each(root, "occluders", [&](const auto& entry) { return read_occluder(entry, world); });
  if (status)
    status = each(root, "keep_outs", [&](const auto& entry) { return read_keep_out(entry, world); });
  if (status) status = read_floor(root, world.floor);
  return status;
}

}  // namespace waymark::internal

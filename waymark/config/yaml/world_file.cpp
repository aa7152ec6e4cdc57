#include "waymark/config/yaml/world_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_tree.hpp"
#include "waymark/samples/tag_sizes.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark::internal {
namespace {

constexpr YamlLimits kWorldLimits{.bytes = std::size_t{1} << 22U, .nodes = 200'000, .depth = 16};

/// Reads a point [x, y] from a list.
[[nodiscard]] Result<Eigen::Vector2d> read_point(const YamlCursor& point);

/// Adds a tag to a world; fails if its id is a duplicate or not in the family.
Result<TagId> place_tag(const YamlCursor& entry, FamilyId family, const SE3& map_T_tag, double size_m,
                        World& world);

/// Reads every entry of an optional list.
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
    return entry.fail_here(ErrorCode::InvalidArgument, "the wall has no length");
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
    return entry.fail_here(ErrorCode::InvalidArgument, "an area needs at least three corners");
  world.keep_outs.push_back(std::move(area));
  return {};
}

Status read_world_floor(const YamlCursor& root, Floor& floor) {
  const auto entry = root.find("floor");
  if (!entry) return {};
  Status status = entry->check_keys({"texture", "reflectance", "contrast", "cell_m"});
  if (!status) return status;
  if (entry->find("texture")) {
    const auto texture = entry->read_at("texture", &YamlCursor::text);
    if (!texture) return tl::unexpected(texture.error());
    if (std::ranges::find(kFloorTextures, *texture) == kFloorTextures.end())
      return entry->at("texture")->fail_here(
          ErrorCode::InvalidArgument, fmt::format("unknown floor texture '{}'", *texture),
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

/// Reads the optional contents of a world other than single tags: panels (whose tags are added to those of
/// the world), walls, occluders, keep_outs, floor, tag_margin_cells, corners_through_paper. `size_m` is the
/// default tag size.
Status read_scenery(const YamlCursor& root, FamilyId family, double size_m, World& world) {
  Numbers value(root);
  world.tag_margin_cells = value.optional_within("tag_margin_cells", world.tag_margin_cells, 0, 20);
  world.tag_board_m = value.optional_within("two_sided_board_m", world.tag_board_m, 0, 1);
  Status status = value.status();
  if (const auto through = root.find("corners_through_paper"); status && through) {
    const Result<bool> value_read = through->boolean();
    if (!value_read) return tl::unexpected(value_read.error());
    world.corners_through_paper = *value_read;
  }
  if (status)
    status = each(root, "panels",
                  [&](const YamlCursor& entry) { return read_panel(entry, family, size_m, world); });
  if (status) status = each(root, "walls", [&](const auto& entry) { return read_wall(entry, world); });
  if (status)
    status = each(root, "occluders", [&](const auto& entry) { return read_occluder(entry, world); });
  if (status)
    status = each(root, "keep_outs", [&](const auto& entry) { return read_keep_out(entry, world); });
  if (status) status = read_world_floor(root, world.floor);
  return status;
}

}  // namespace
}  // namespace waymark::internal

namespace waymark {
namespace {

/// The path is counted: it is the last list that is written, and tags and boxes are often added by hand.
constexpr internal::EntryCount kPathPointCount{.key = "path_point_count", .entries = "path points"};

/// Rotation of a tag in its own plane, clockwise as seen by a viewer.
SE3 tag_turn(double turn_rad) { return {SO3::from_rpy(0, 0, turn_rad), Eigen::Vector3d::Zero()}; }

Status read_world_tag(const YamlCursor& entry, FamilyId family_id, double size_m, World& world) {
  Status status =
      entry.check_keys({"id", "x_m", "y_m", "z_m", "facing_deg", "tilt_deg", "turn_deg", "size_m"});
  if (!status) return status;
  internal::Numbers value(entry);
  const Eigen::Vector3d map_t_tag(value("x_m"), value("y_m"), value("z_m"));
  const SE3 leaning =
      leaning_tag(map_t_tag, to_radians(value("facing_deg")), to_radians(value.optional("tilt_deg", 0)));
  const SE3 map_T_tag = leaning * tag_turn(to_radians(value.optional("turn_deg", 0)));
  const double size = value.optional_positive("size_m", size_m);
  if (!value.status()) return value.status();
  const auto tag = internal::place_tag(entry, family_id, map_T_tag, size, world);
  return tag ? Status() : tl::unexpected(tag.error());
}

Status read_path(const YamlCursor& path, World& world) {
  for (const YamlCursor& point : path.children()) {
    const auto xy = internal::read_point(point);
    if (!xy) return tl::unexpected(xy.error());
    world.path_m.push_back(*xy);
  }
  if (world.path_m.size() < 3)
    return path.fail_here(ErrorCode::InvalidArgument, "a path needs at least three points");
  return {};
}

Status read_tags(const YamlCursor& root, World& world) {
  const Result<std::string> family_name = root.read_at("tag_family", &YamlCursor::text);
  if (!family_name) return tl::unexpected(family_name.error());
  const Result<FamilyId> family_id = parse_family(*family_name);
  if (!family_id)
    return root.at("tag_family")
        ->fail_here(family_id.error().code, family_id.error().message, family_id.error().hint);
  const Result<double> size = root.read_at("tag_size_m", &YamlCursor::number);
  if (!size) return tl::unexpected(size.error());
  if (!is_tag_size(*size) || *size > kMaxTagSize_m)
    return root.at("tag_size_m")
        ->fail_here(ErrorCode::InvalidArgument,
                    fmt::format("a tag size of {:g} m is outside (0, {:g}]", *size, kMaxTagSize_m),
                    "Give the side of the black square in metres.");
  const Result<YamlCursor> tags = root.at("tags");
  if (!tags) return tl::unexpected(tags.error());
  for (const YamlCursor& entry : tags->children()) {
    if (Status status = read_world_tag(entry, *family_id, *size, world); !status) return status;
  }
  if (Status status = internal::read_scenery(root, *family_id, *size, world); !status) return status;
  const Result<YamlCursor> anchor = root.at("anchor_id");
  if (!anchor) return tl::unexpected(anchor.error());
  const Result<std::int64_t> number = anchor->integer(0, 1'000'000);
  if (!number) return tl::unexpected(number.error());
  world.anchor = {*family_id, static_cast<int>(*number)};
  if (world.tags.find(world.anchor) == nullptr) {
    return anchor->fail_here(ErrorCode::InvalidArgument,
                             fmt::format("{} is not among the tags", to_string(world.anchor)));
  }
  return {};
}

}  // namespace

Result<World> parse_world(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_yaml(text, source, internal::kWorldLimits);
  if (!tree) return tl::unexpected(tree.error());
  const YamlCursor root(*tree, source);
  if (Status status = root.check_keys({"name", kPathPointCount.key, "robot", "tag_family", "tag_size_m",
                                       "tag_margin_cells", "two_sided_board_m", "corners_through_paper",
                                       "anchor_id", "tags", "panels", "walls", "occluders", "keep_outs",
                                       "floor", "path_closed", "path_m", "end"});
      !status) {
    return tl::unexpected(status.error());
  }
  const auto points = root.find("path_m");
  const std::size_t count = points ? points->children().size() : 0;
  if (Status status = internal::check_end(root, kPathPointCount, count); !status)
    return tl::unexpected(status.error());
  World world;
  const Result<std::string> name = root.read_at("name", &YamlCursor::text);
  if (!name) return tl::unexpected(name.error());
  world.name = *name;
  if (Status status = read_tags(root, world); !status) return tl::unexpected(status.error());
  const Result<bool> closed = root.read_at("path_closed", &YamlCursor::boolean);
  if (!closed) return tl::unexpected(closed.error());
  world.path_closed = *closed;
  const Result<YamlCursor> path = root.at("path_m");
  if (!path) return tl::unexpected(path.error());
  if (Status status = read_path(*path, world); !status) return tl::unexpected(status.error());
  return world;
}

std::string to_yaml(const World& world) {
  const MappedTag* anchor = world.tags.find(world.anchor);
  const double size_m = anchor == nullptr ? 0.16 : anchor->size_m;
  std::string text =
      fmt::format("tag_family: {}\ntag_size_m: {}\n{}{}{}anchor_id: {}\ntags:\n",
                  family(world.anchor.family).name, size_m,
                  world.tag_margin_cells != World{}.tag_margin_cells
                      ? fmt::format("tag_margin_cells: {}\n", world.tag_margin_cells)
                      : "",
                  world.tag_board_m > 0 ? fmt::format("two_sided_board_m: {}\n", world.tag_board_m) : "",
                  world.corners_through_paper ? "corners_through_paper: true\n" : "", world.anchor.number);
  for (const auto& [id, tag] : world.tags.tags) {
    const Eigen::Vector3d& place = tag.map_T_tag.translation();
    const Eigen::Vector3d to_reader = tag.map_T_tag.rotation() * -Eigen::Vector3d::UnitZ();
    text +=
        fmt::format("  - {{id: {}, x_m: {:.3f}, y_m: {:.3f}, z_m: {:.3f}, facing_deg: {:.1f}", id.number,
                    place.x(), place.y(), place.z(), to_degrees(std::atan2(to_reader.y(), to_reader.x())));
    const double tilt_deg = to_degrees(std::asin(std::clamp(to_reader.z(), -1.0, 1.0)));
    if (std::abs(tilt_deg) >= 0.05) text += fmt::format(", tilt_deg: {:.1f}", tilt_deg);
    const SE3 leaning = leaning_tag(place, std::atan2(to_reader.y(), to_reader.x()), to_radians(tilt_deg));
    const double turn_deg = to_degrees((leaning.inverse() * tag.map_T_tag).rotation().rpy().z());
    if (std::abs(turn_deg) >= 0.05) text += fmt::format(", turn_deg: {:.1f}", turn_deg);
    if (tag.size_m != size_m) text += fmt::format(", size_m: {}", tag.size_m);
    text += "}\n";
  }
  if (!world.occluders.empty()) text += "occluders:\n";
  for (const Occluder& box : world.occluders)
    text += fmt::format(
        "  - {{x_m: {:.3f}, y_m: {:.3f}, z_m: {:.3f}, yaw_deg: {:.1f}, length_m: {:.3f}, width_m: {:.3f}, "
        "height_m: {:.3f}, reflectance: {:.2f}}}\n",
        box.centre_m.x(), box.centre_m.y(), box.centre_m.z(), to_degrees(box.yaw_rad), box.size_m.x(),
        box.size_m.y(), box.size_m.z(), box.reflectance);
  text += fmt::format("path_closed: {}\npath_m:\n", world.path_closed);
  for (const Eigen::Vector2d& point : world.path_m)
    text += fmt::format("  - [{:.4f}, {:.4f}]\n", point.x(), point.y());
  return internal::yaml_with_end(fmt::format("name: {}\n", yaml_text(world.name)), kPathPointCount,
                                 world.path_m.size(), text);
}

Result<World> read_world(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, internal::kWorldLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_world(*text, path.string());
}

Result<std::string> robot_of_world(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_yaml(text, source, internal::kWorldLimits);
  if (!tree) return tl::unexpected(tree.error());
  const auto robot = YamlCursor(*tree, source).find("robot");
  return robot ? robot->text() : std::string();
}

}  // namespace waymark

#include "waymark/config/world_file.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/world_scenery.hpp"
#include "waymark/config/yaml_numbers.hpp"
#include "waymark/config/yaml_write.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {
namespace {

/// Of a tag in its own plane, clockwise as its reader sees it.
SE3 tag_turn(double turn_rad) { return {SO3::from_rpy(0, 0, turn_rad), Eigen::Vector3d::Zero()}; }

Status read_tag(const YamlCursor& entry, FamilyId family_id, double size_m, World& world) {
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
    return path.fail_here(ErrorCode::InvalidArgument, "a path needs three points or more");
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
  if (!is_tag_size(*size))
    return root.at("tag_size_m")->fail_here(ErrorCode::InvalidArgument, "a tag has a size greater than 0");
  const Result<YamlCursor> tags = root.at("tags");
  if (!tags) return tl::unexpected(tags.error());
  for (const YamlCursor& entry : tags->children()) {
    if (Status status = read_tag(entry, *family_id, *size, world); !status) return status;
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
  if (Status status =
          root.check_keys({"name", "robot", "tag_family", "tag_size_m", "tag_margin_cells",
                           "two_sided_board_m", "corners_through_paper", "anchor_id", "tags", "panels",
                           "walls", "occluders", "keep_outs", "floor", "path_closed", "path_m"});
      !status) {
    return tl::unexpected(status.error());
  }
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
      fmt::format("name: {}\ntag_family: {}\ntag_size_m: {}\n{}{}{}anchor_id: {}\ntags:\n",
                  yaml_text(world.name), family(world.anchor.family).name, size_m,
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
  return text;
}

Result<World> read_world(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, internal::kWorldLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_world(*text, path.string());
}

}  // namespace waymark

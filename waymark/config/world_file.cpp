#include "waymark/config/world_file.hpp"

#include <numbers>

#include <fmt/format.h>

#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_numbers.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {
namespace {

constexpr YamlLimits kWorldLimits{.bytes = std::size_t{1} << 22U, .nodes = 200'000, .depth = 16};

Status read_tag(const YamlCursor& entry, FamilyId family_id, double size_m, World& world) {
  if (Status status = entry.check_keys({"id", "x_m", "y_m", "z_m", "facing_deg"}); !status) return status;
  const auto most = static_cast<std::int64_t>(family(family_id).codes.size()) - 1;
  const Result<YamlCursor> id = entry.at("id");
  if (!id) return tl::unexpected(id.error());
  const Result<std::int64_t> number = id->integer(0, most);
  if (!number) return tl::unexpected(number.error());
  internal::Numbers value(entry);
  const Eigen::Vector3d map_t_tag(value("x_m"), value("y_m"), value("z_m"));
  const SE3 map_T_tag = upright_tag(map_t_tag, value("facing_deg") * std::numbers::pi / 180);
  if (!value.status()) return value.status();
  const TagId tag{family_id, static_cast<int>(*number)};
  if (!world.tags.tags.emplace(tag, MappedTag{.map_T_tag = map_T_tag, .size_m = size_m}).second) {
    return id->fail_here(ErrorCode::InvalidArgument, fmt::format("{} is given twice", to_string(tag)));
  }
  return {};
}

Status read_path(const YamlCursor& path, World& world) {
  for (const YamlCursor& point : path.children()) {
    const std::vector<YamlCursor> xy = point.children();
    if (xy.size() != 2)
      return point.fail_here(ErrorCode::InvalidArgument, "is not a point", "Write [x, y] in metres.");
    const Result<double> x = xy[0].number();
    const Result<double> y = xy[1].number();
    if (!x) return tl::unexpected(x.error());
    if (!y) return tl::unexpected(y.error());
    if (Status status = internal::check_proportion(point, std::vector{*x, *y}); !status) return status;
    world.path_m.emplace_back(*x, *y);
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
  const Result<YamlNode> tree = parse_yaml(text, source, kWorldLimits);
  if (!tree) return tl::unexpected(tree.error());
  const YamlCursor root(*tree, source);
  if (Status status =
          root.check_keys({"name", "tag_family", "tag_size_m", "anchor_id", "tags", "path_closed", "path_m"});
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

Result<World> read_world(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kWorldLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_world(*text, path.string());
}

}  // namespace waymark

#include "waymark/config/yaml/map_file.hpp"

#include <cmath>
#include <set>

#include <fmt/format.h>

#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_tree.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {
namespace {

constexpr YamlLimits kMapLimits{.bytes = std::size_t{1} << 26U, .nodes = 2'000'000, .depth = 16};
constexpr const char* kFormat = "waymark-map-1";
constexpr internal::EntryCount kTagCount{.key = "tag_count", .entries = "tags"};
using Covariance = Eigen::Matrix<double, 6, 6>;

Result<SE3> read_pose(const YamlCursor& entry) {
  const auto exactly = [](std::size_t count) {
    return [count](const YamlCursor& c) { return c.exactly_numbers(count); };
  };
  const auto p = entry.read_at("position_m", exactly(3));
  if (!p) return tl::unexpected(p.error());
  if (Status status = internal::check_proportion(*entry.at("position_m"), *p); !status)
    return tl::unexpected(status.error());
  const auto q = entry.read_at("quaternion_xyzw", exactly(4));
  if (!q) return tl::unexpected(q.error());
  const auto rotation = SO3::try_from_quaternion(Eigen::Quaterniond((*q)[3], (*q)[0], (*q)[1], (*q)[2]));
  if (!rotation)
    return entry.at("quaternion_xyzw")->fail_here(rotation.error().code, rotation.error().message);
  return SE3(*rotation, Eigen::Vector3d((*p)[0], (*p)[1], (*p)[2]));
}

/// The symmetric matrix with this upper triangle (row-major).
template <int N>
Eigen::Matrix<double, N, N> symmetric(const std::vector<double>& upper) {
  Eigen::Matrix<double, N, N> P;
  std::size_t next = 0;
  for (int i = 0; i < N; ++i) {
    for (int j = i; j < N; ++j) P(i, j) = P(j, i) = upper[next++];
  }
  return P;
}

/// The upper triangle, row-major.
template <int N>
std::vector<double> upper_triangle(const Eigen::Matrix<double, N, N>& P) {
  std::vector<double> upper;
  for (int i = 0; i < N; ++i) {
    for (int j = i; j < N; ++j) upper.push_back(P(i, j));
  }
  return upper;
}

Result<Covariance> read_covariance(const YamlCursor& entry) {
  const auto values = entry.exactly_numbers(21);
  if (!values) return tl::unexpected(values.error());
  if (Status status = internal::check_proportion(entry, *values); !status)
    return tl::unexpected(status.error());
  const Covariance covariance = symmetric<6>(*values);
  if ((covariance.diagonal().array() < 0).any())
    return entry.fail_here(ErrorCode::InvalidArgument, "negative variance");
  return covariance;
}

Result<TagId> read_id(const YamlCursor& cursor) {
  const Result<std::string> text = cursor.text();
  if (!text) return tl::unexpected(text.error());
  const Result<TagId> tag = parse_tag_id(*text);
  if (!tag) return cursor.fail_here(tag.error().code, tag.error().message, tag.error().hint);
  return *tag;
}

Status read_tie(const YamlCursor& entry, MappedTag& mapped) {
  if (!entry.find("tied_to") && !entry.find("tied_covariance")) return {};
  const Result<TagId> to = entry.read_at("tied_to", read_id);
  if (!to) return tl::unexpected(to.error());
  const auto values =
      entry.read_at("tied_covariance", [](const YamlCursor& c) { return c.exactly_numbers(36); });
  if (!values) return tl::unexpected(values.error());
  if (Status status = internal::check_proportion(*entry.at("tied_covariance"), *values); !status)
    return status;
  mapped.tie = TagTie{.to = *to};
  for (Eigen::Index i = 0; i < 6; ++i) {
    for (Eigen::Index j = 0; j < 6; ++j)
      mapped.tie->covariance(i, j) = (*values)[static_cast<std::size_t>(6 * i + j)];
  }
  return {};
}

/// Checks that ties connect tags in the map and end at a tag without a tie.
Status check_ties(const YamlCursor& root, const TagMap& map) {
  std::set<TagId> fine;
  for (const auto& [id, mapped] : map.tags) {
    std::vector<TagId> path;
    std::set<TagId> on_path;
    for (TagId at = id; !fine.contains(at);) {
      path.push_back(at);
      const bool circle = !on_path.insert(at).second;
      const MappedTag& tag = map.tags.at(at);
      const MappedTag* to = tag.tie ? map.find(tag.tie->to) : nullptr;
      if (circle || (tag.tie && (to == nullptr || !tag.covariance || !to->covariance)))
        return root.fail_here(
            ErrorCode::InvalidArgument,
            circle ? fmt::format("the ties of {} form a cycle", to_string(at))
                   : fmt::format("{} is tied to {}, but not both are among the tags with a covariance",
                                 to_string(at), to_string(tag.tie->to)),
            "Remove tied_to and tied_covariance.");
      if (!tag.tie) break;
      at = tag.tie->to;
    }
    fine.insert(path.begin(), path.end());
  }
  return {};
}

Status read_tag(const YamlCursor& entry, MapFile& map) {
  Status status = entry.check_keys({"tag", "size_m", "position_m", "quaternion_xyzw", "observations",
                                    "covariance", "tied_to", "tied_covariance"});
  if (!status) return status;
  const Result<TagId> tag = entry.read_at("tag", read_id);
  if (!tag) return tl::unexpected(tag.error());
  MappedTag mapped;
  const Result<double> size = entry.read_at("size_m", &YamlCursor::number);
  if (!size) return tl::unexpected(size.error());
  mapped.size_m = *size;
  constexpr double kLargestMetres = 1000;
  if (!is_tag_size(mapped.size_m) || mapped.size_m > kLargestMetres)
    return entry.at("size_m")->fail_here(
        ErrorCode::InvalidArgument,
        fmt::format("a tag size of {:g} m is outside (0, {:g}]", mapped.size_m, kLargestMetres),
        "Give the side of the black square in metres.");
  const Result<SE3> map_T_tag = read_pose(entry);
  if (!map_T_tag) return tl::unexpected(map_T_tag.error());
  mapped.map_T_tag = *map_T_tag;
  if (const auto covariance = entry.find("covariance")) {
    const Result<Covariance> values = read_covariance(*covariance);
    if (!values) return tl::unexpected(values.error());
    mapped.covariance = *values;
  }
  if (Status tied = read_tie(entry, mapped); !tied) return tied;
  if (const auto observations = entry.find("observations")) {
    const auto count = observations->integer(0, 1'000'000'000);
    if (!count) return tl::unexpected(count.error());
    map.observations[*tag] = static_cast<int>(*count);
  }
  if (!map.tags.tags.emplace(*tag, mapped).second)
    return entry.at("tag")->fail_here(ErrorCode::InvalidArgument,
                                      fmt::format("{} is given twice", to_string(*tag)));
  return {};
}

/// Reads the floor; older maps contain only its height.
Result<FloorPlane> read_floor(const YamlCursor& root) {
  FloorPlane plane;
  const auto older = root.find("floor_z_m");
  const auto floor = root.find("floor");
  if (older && floor)
    return older->fail_here(ErrorCode::InvalidArgument, "the floor is given twice", "Remove floor_z_m.");
  if (older) {
    const Result<double> z_m = older->number();
    if (!z_m) return tl::unexpected(z_m.error());
    plane.z_m = *z_m;
  }
  if (!floor) return plane;
  if (Status status = floor->check_keys({"z_m", "normal", "covariance"}); !status)
    return tl::unexpected(status.error());
  const Result<double> z_m = floor->read_at("z_m", &YamlCursor::number);
  if (!z_m) return tl::unexpected(z_m.error());
  plane.z_m = *z_m;
  const auto n = floor->read_at("normal", [](const YamlCursor& c) { return c.exactly_numbers(3); });
  if (!n) return tl::unexpected(n.error());
  const Eigen::Vector3d normal((*n)[0], (*n)[1], (*n)[2]);
  constexpr double kUpright = 0.5;  // cosine of the largest angle to the vertical
  if (!(std::abs(normal.norm() - 1) < 1e-6) || normal.z() < kUpright)
    return floor->at("normal")->fail_here(ErrorCode::InvalidArgument,
                                          "the normal of the floor must have length 1 and point upwards");
  plane.normal = normal.normalized();
  const auto covariance = floor->find("covariance");
  if (!covariance) return plane;
  const auto values = covariance->exactly_numbers(6);
  if (!values) return tl::unexpected(values.error());
  if (Status status = internal::check_proportion(*covariance, *values); !status)
    return tl::unexpected(status.error());
  plane.covariance = symmetric<3>(*values);
  if ((plane.covariance->diagonal().array() < 0).any())
    return covariance->fail_here(ErrorCode::InvalidArgument, "negative variance");
  return plane;
}

Status check_format(const YamlCursor& root) {
  const Result<std::string> format = root.read_at("format", &YamlCursor::text);
  if (!format)
    return root.fail_here(
        ErrorCode::Unreadable, "not a Waymark map",
        fmt::format("A map begins with `format: {}`; write one with `waymark map`.", kFormat));
  if (*format != kFormat)
    return root.at("format")->fail_here(ErrorCode::Unsupported,
                                        fmt::format("unsupported map format '{}'", *format),
                                        fmt::format("Known: {}.", kFormat));
  if (Status status = root.check_keys(
          {"format", kTagCount.key, "anchor", "floor", "floor_z_m", "provenance", "tags", "end"});
      !status)
    return status;
  const auto tags = root.find("tags");
  return internal::check_end(root, kTagCount, tags ? tags->children().size() : 0);
}

std::string covariance_line(const Covariance& covariance) {
  return "    covariance: " + yaml_list(upper_triangle<6>(covariance)) + "\n";
}

/// Empty for the default floor: z = 0 without uncertainty.
std::string floor_yaml(const FloorPlane& floor) {
  if (floor.z_m == 0 && floor.normal == Eigen::Vector3d::UnitZ() && !floor.covariance) return {};
  std::string text =
      fmt::format("floor:\n  z_m: {}\n  normal: {}\n", yaml_number(floor.z_m),
                  yaml_list(std::vector{floor.normal.x(), floor.normal.y(), floor.normal.z()}));
  if (floor.covariance) text += "  covariance: " + yaml_list(upper_triangle<3>(*floor.covariance)) + "\n";
  return text;
}

std::string tie_lines(const TagTie& tie) {
  std::vector<double> rows;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) rows.push_back(tie.covariance(i, j));
  }
  return fmt::format("    tied_to: {}\n    tied_covariance: {}\n", yaml_text(to_string(tie.to)),
                     yaml_list(rows));
}

}  // namespace

Result<MapFile> parse_map(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_yaml(text, source, kMapLimits);
  if (!tree) return tl::unexpected(tree.error());
  const YamlCursor root(*tree, source);
  Status status = check_format(root);
  if (!status) return tl::unexpected(status.error());
  MapFile map;
  auto provenance = internal::read_provenance(root);
  if (!provenance) return tl::unexpected(provenance.error());
  map.provenance = std::move(*provenance);
  const Result<FloorPlane> floor = read_floor(root);
  if (!floor) return tl::unexpected(floor.error());
  map.tags.floor = *floor;
  const Result<YamlCursor> tags = root.at("tags");
  if (!tags) return tl::unexpected(tags.error());
  for (const YamlCursor& entry : tags->children()) {
    if (status = read_tag(entry, map); !status) return tl::unexpected(status.error());
  }
  if (status = check_ties(*tags, map.tags); !status) return tl::unexpected(status.error());
  if (map.tags.tags.empty())
    return tags->fail_here(ErrorCode::InvalidArgument, "the map contains no tags",
                           "Map a recording in which tags are in view.");
  const Result<TagId> anchor = root.read_at("anchor", read_id);
  if (!anchor) return tl::unexpected(anchor.error());
  map.anchor = *anchor;
  if (map.tags.find(map.anchor) == nullptr)
    return root.at("anchor")->fail_here(ErrorCode::InvalidArgument,
                                        fmt::format("{} is not among the tags", to_string(map.anchor)));
  return map;
}

std::filesystem::path map_file_of(const std::filesystem::path& map_or_folder) {
  std::error_code ignored;
  return std::filesystem::is_directory(map_or_folder, ignored) ? map_or_folder / "map.yaml" : map_or_folder;
}

Result<MapFile> read_map(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kMapLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_map(*text, path.string());
}

std::string to_yaml(const MapFile& map) {
  const std::string head = fmt::format(
      "# A map of tags by Waymark. Frame map: z up. Tag frame: centre of the black square, x right, y down, "
      "z into the tag.\nformat: {}\n",
      kFormat);
  std::string text = fmt::format("anchor: {}\n", yaml_text(to_string(map.anchor)));
  text += floor_yaml(map.tags.floor);
  text += internal::provenance_yaml(map.provenance);
  text += map.tags.tags.empty() ? "tags: []\n" : "tags:\n";
  for (const auto& [tag, mapped] : map.tags.tags) {
    const Eigen::Vector3d& p = mapped.map_T_tag.translation();
    const Eigen::Quaterniond& q = mapped.map_T_tag.rotation().quaternion();
    text += fmt::format("  - tag: {}\n    size_m: {}\n    position_m: {}\n    quaternion_xyzw: {}\n",
                        yaml_text(to_string(tag)), yaml_number(mapped.size_m),
                        yaml_list(std::vector{p.x(), p.y(), p.z()}),
                        yaml_list(std::vector{q.x(), q.y(), q.z(), q.w()}));
    if (const auto seen = map.observations.find(tag); seen != map.observations.end())
      text += fmt::format("    observations: {}\n", seen->second);
    if (mapped.covariance) text += covariance_line(*mapped.covariance);
    if (mapped.tie) text += tie_lines(*mapped.tie);
  }
  return internal::yaml_with_end(head, kTagCount, map.tags.tags.size(), text);
}

Status write_map(const std::filesystem::path& path, const MapFile& map) {
  const FloorPlane& floor = map.tags.floor;
  if (!std::isfinite(floor.z_m) || !floor.normal.allFinite() ||
      (floor.covariance && !floor.covariance->allFinite()))
    return fail(ErrorCode::InvalidArgument, "non-finite number in the floor; not written",
                {.source = path.string()});
  for (const auto& [tag, mapped] : map.tags.tags) {
    if (!exists(tag))
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("no tag {} in {}; not written", tag.number, to_string(tag.family)),
                  {.source = path.string()}, "Are the tags of another family?");
    const bool finite = mapped.map_T_tag.matrix().allFinite() && is_tag_size(mapped.size_m) &&
                        (!mapped.covariance || mapped.covariance->allFinite()) &&
                        (!mapped.tie || mapped.tie->covariance.allFinite());
    if (!finite)
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("non-finite number in {}; not written", to_string(tag)),
                  {.source = path.string()});
  }
  return write_text_file(path, to_yaml(map));
}

}  // namespace waymark

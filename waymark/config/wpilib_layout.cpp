#include "waymark/config/wpilib_layout.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "waymark/base/angles.hpp"
#include "waymark/config/fmap_layout.hpp"
#include "waymark/config/json_text.hpp"
#include "waymark/config/yaml_cursor.hpp"
#include "waymark/config/yaml_write.hpp"
#include "waymark/evaluation/csv.hpp"

namespace waymark {
namespace {

constexpr YamlLimits kLimits{.bytes = std::size_t{1} << 26U, .nodes = 2'000'000, .depth = 16};
constexpr double kInch_m = 0.0254;
constexpr int kCodes = 587;  // of tag36h11

/// The first line, in small letters and without spaces.
std::string header_of(std::string_view text) {
  std::string header;
  for (const char c : text.substr(0, text.find('\n')))
    if (c != ' ' && c != '\r' && c != '"')
      header += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return header;
}

bool is_layout_header(const std::string& header) {
  return header.starts_with("id,x,y,z,") && header.find("rotation") != std::string::npos;
}

Result<Eigen::Vector3d> vector_of(const YamlCursor& at) {
  Eigen::Vector3d v;
  const auto x = at.read_at("x", &YamlCursor::number);
  if (!x) return tl::unexpected(x.error());
  const auto y = at.read_at("y", &YamlCursor::number);
  if (!y) return tl::unexpected(y.error());
  const auto z = at.read_at("z", &YamlCursor::number);
  if (!z) return tl::unexpected(z.error());
  return Eigen::Vector3d(*x, *y, *z);
}

Result<SO3> rotation_of(const YamlCursor& at) {
  const auto q = at.at("quaternion");
  if (!q) return tl::unexpected(q.error());
  Eigen::Vector4d wxyz;
  constexpr std::array<const char*, 4> kKeys = {"W", "X", "Y", "Z"};
  for (std::size_t i = 0; i < kKeys.size(); ++i) {
    const auto number = q->read_at(kKeys.at(i), &YamlCursor::number);
    if (!number) return tl::unexpected(number.error());
    wxyz[static_cast<Eigen::Index>(i)] = *number;
  }
  const auto rotation = SO3::try_from_quaternion(Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]));
  if (!rotation) return q->fail_here(rotation.error().code, rotation.error().message);
  return *rotation;
}

MappedTag mapped(const SO3& field_R_theirs, const Eigen::Vector3d& field_p_tag, double size_m) {
  return {.map_T_tag = SE3(field_R_theirs * wpilib_R_tag(), field_p_tag), .size_m = size_m};
}

Result<TagMap> parse_layout_json(std::string_view text, const std::string& source, double size_m) {
  const Result<YamlNode> tree = parse_json(text, source, kLimits);
  if (!tree) return tl::unexpected(tree.error());
  const Result<YamlCursor> tags = YamlCursor(*tree, source).at("tags");
  if (!tags) return tl::unexpected(tags.error());
  TagMap map;
  for (const YamlCursor& entry : tags->children()) {
    const auto id = entry.read_at("ID", [](const YamlCursor& c) { return c.integer(0, kCodes - 1); });
    if (!id) return tl::unexpected(id.error());
    const auto pose = entry.at("pose");
    if (!pose) return tl::unexpected(pose.error());
    const auto p = pose->read_at("translation", vector_of);
    if (!p) return tl::unexpected(p.error());
    const auto R = pose->read_at("rotation", rotation_of);
    if (!R) return tl::unexpected(R.error());
    const TagId tag{FamilyId::Tag36h11, static_cast<int>(*id)};
    if (!map.tags.emplace(tag, mapped(*R, *p, size_m)).second)
      return entry.fail_here(ErrorCode::InvalidArgument, fmt::format("tag {} is given twice", *id));
  }
  return map;
}

Result<TagMap> parse_layout_csv(std::string_view text, const std::string& source, double size_m) {
  const Result<CsvTable> table = parse_csv(text, source);
  if (!table) return tl::unexpected(table.error());
  TagMap map;
  for (const CsvRow& row : table->rows) {
    const Result<int> id = csv_integer(*table, row, 0);
    if (!id) return tl::unexpected(id.error());
    Eigen::Matrix<double, 5, 1> n = Eigen::Matrix<double, 5, 1>::Zero();
    const std::size_t columns = std::min<std::size_t>(table->columns.size(), 6);
    for (std::size_t i = 1; i < columns; ++i) {
      const Result<double> number = csv_number(*table, row, i);
      if (!number) return tl::unexpected(number.error());
      n[static_cast<Eigen::Index>(i) - 1] = *number;
    }
    if (*id < 0 || *id >= kCodes)
      return fail(ErrorCode::InvalidArgument, fmt::format("tag36h11 has no tag {}", *id),
                  {.source = source, .line = row.line});
    const SO3 R = SO3::from_rpy(0, to_radians(n[4]), to_radians(n[3]));
    if (!map.tags.emplace(TagId{FamilyId::Tag36h11, *id}, mapped(R, kInch_m * n.head<3>(), size_m)).second)
      return fail(ErrorCode::InvalidArgument, fmt::format("tag {} is given twice", *id),
                  {.source = source, .line = row.line});
  }
  return map;
}

}  // namespace

bool looks_like_wpilib_layout(std::string_view text) {
  if (looks_like_json(text)) return text.find("\"tags\"") != std::string_view::npos;
  return is_layout_header(header_of(text));
}

Result<TagMap> parse_wpilib_layout(std::string_view text, const std::string& source,
                                   std::optional<double> tag_size_m) {
  const double size_m = tag_size_m.value_or(kWpilibTagSize_m);
  Result<TagMap> map = looks_like_json(text) ? parse_layout_json(text, source, size_m)
                                             : parse_layout_csv(text, source, size_m);
  if (map && map->tags.empty())
    return fail(ErrorCode::NotFound, "this layout has no tags", {.source = source});
  return map;
}

std::string to_wpilib_layout(const TagMap& map, const std::optional<FieldSize>& field) {
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();
  std::string text = "{\n  \"tags\": [\n";
  const char* comma = "";
  for (const auto& [id, tag] : map.tags) {
    const Eigen::Vector3d p = tag.map_T_tag.translation();
    const Eigen::Quaterniond q = (tag.map_T_tag.rotation() * wpilib_R_tag().inverse()).quaternion();
    corner = corner.cwiseMax(p.head<2>());
    text += fmt::format(
        "{}    {{\n      \"ID\": {},\n      \"pose\": {{\n"
        "        \"translation\": {{\"x\": {}, \"y\": {}, \"z\": {}}},\n"
        "        \"rotation\": {{\"quaternion\": {{\"W\": {}, \"X\": {}, \"Y\": {}, \"Z\": {}}}}}\n      "
        "}}\n    }}",
        comma, id.number, yaml_number(p.x()), yaml_number(p.y()), yaml_number(p.z()), yaml_number(q.w()),
        yaml_number(q.x()), yaml_number(q.y()), yaml_number(q.z()));
    comma = ",\n";
  }
  const FieldSize size = field.value_or(FieldSize{corner.x(), corner.y()});
  return text + fmt::format("\n  ],\n  \"field\": {{\"length\": {}, \"width\": {}}}\n}}\n",
                            yaml_number(size.length_m), yaml_number(size.width_m));
}

}  // namespace waymark

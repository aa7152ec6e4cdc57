#include "waymark/config/exchange/field_layouts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Geometry>

#include "waymark/base/angles.hpp"
#include "waymark/config/exchange/xyz.hpp"
#include "waymark/config/json_text.hpp"
#include "waymark/config/yaml_tree.hpp"
#include "waymark/evaluation/csv.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {
namespace {

std::optional<FieldSize> size_at(const YamlCursor& at, const char* length, const char* width) {
  if (!at.is_map()) return std::nullopt;
  const auto length_m = at.read_at(length, &YamlCursor::number);
  const auto width_m = at.read_at(width, &YamlCursor::number);
  if (!length_m || !width_m || !(*length_m > 0) || !(*width_m > 0)) return std::nullopt;
  return FieldSize{*length_m, *width_m};
}

}  // namespace

std::optional<FieldSize> field_size_of(std::string_view json) {
  constexpr YamlLimits kLimits{.bytes = std::size_t{1} << 26U, .nodes = 10'000, .depth = 16};
  if (!looks_like_json(json)) return std::nullopt;
  const auto tree = parse_json(json, "", kLimits, {"tags", "fiducials"});
  if (!tree) return std::nullopt;
  const YamlCursor root(*tree, "");
  if (const auto field = root.find("field")) return size_at(*field, "length", "width");
  return size_at(root, "fieldlength", "fieldwidth");
}

namespace {

constexpr YamlLimits kLimits{.bytes = std::size_t{1} << 26U, .nodes = 2'000'000, .depth = 16};
constexpr double kMillimetre = 1e-3;

constexpr std::array<std::pair<const char*, FamilyId>, 4> kFamilies = {{
    {"apriltag3_36h11_classic", FamilyId::Tag36h11},
    {"apriltag3_25h9_classic", FamilyId::Tag25h9},
    {"apriltag3_16h5_classic", FamilyId::Tag16h5},
    {"apriltag3_41h12_standard", FamilyId::TagStandard41h12},
}};

Result<FamilyId> family_of(const YamlCursor& at) {
  const Result<std::string> name = at.text();
  if (!name) return tl::unexpected(name.error());
  std::vector<std::string> known;
  for (const auto& [text, family] : kFamilies) {
    if (*name == text) return family;
    known.emplace_back(text);
  }
  return at.fail_here(ErrorCode::Unsupported, fmt::format("unsupported family '{}'", *name),
                      fmt::format("Known: {}.", fmt::join(known, ", ")));
}

Result<SE3> pose_of(const YamlCursor& at) {
  const auto numbers = at.exactly_numbers(16);
  if (!numbers) return tl::unexpected(numbers.error());
  const Eigen::Matrix4d T = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers->data());
  const Result<SE3> pose = SE3::try_from_matrix(T);
  if (!pose) return at.fail_here(pose.error().code, pose.error().message);
  return *pose;
}

Status read_fiducial(const YamlCursor& entry, TagMap& map) {
  const auto family = entry.read_at("family", family_of);
  if (!family) return tl::unexpected(family.error());
  const auto id = entry.read_at("id", [](const YamlCursor& c) { return c.integer(0, 1'000'000); });
  if (!id) return tl::unexpected(id.error());
  const auto size_mm = entry.read_at("size", &YamlCursor::number);
  if (!size_mm) return tl::unexpected(size_mm.error());
  if (!check_printed_size(kMillimetre * *size_mm, {}))
    return entry.at("size")->fail_here(
        ErrorCode::InvalidArgument,
        fmt::format("{:g} is not a tag size in millimetres from {:g} to {:g}", *size_mm,
                    kMinTagSize_m / kMillimetre, kMaxTagSize_m / kMillimetre),
        "Sizes in this format are in millimetres, for example 165.1.");
  const auto pose = entry.read_at("transform", pose_of);
  if (!pose) return tl::unexpected(pose.error());
  const TagId tag{*family, static_cast<int>(*id)};
  const SE3 map_T_tag(pose->rotation() * wpilib_R_tag(), pose->translation());
  if (!map.tags.emplace(tag, MappedTag{.map_T_tag = map_T_tag, .size_m = kMillimetre * *size_mm}).second)
    return entry.fail_here(ErrorCode::InvalidArgument, fmt::format("{} is given twice", to_string(tag)));
  return {};
}

}  // namespace

SO3 wpilib_R_tag() { return SO3::from_matrix((Eigen::Matrix3d() << 0, 0, -1, 1, 0, 0, 0, -1, 0).finished()); }

bool looks_like_fmap(std::string_view text) {
  return looks_like_json(text) && text.find("\"fiducials\"") != std::string_view::npos;
}

Result<TagMap> parse_fmap(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_json(text, source, kLimits);
  if (!tree) return tl::unexpected(tree.error());
  const Result<YamlCursor> fiducials = YamlCursor(*tree, source).at("fiducials");
  if (!fiducials) return tl::unexpected(fiducials.error());
  TagMap map;
  for (const YamlCursor& entry : fiducials->children())
    if (Status status = read_fiducial(entry, map); !status) return tl::unexpected(status.error());
  if (map.tags.empty()) return fail(ErrorCode::NotFound, "the field map has no tags", {.source = source});
  return map;
}

Result<std::string> to_fmap(const TagMap& map, const std::optional<FieldSize>& field) {
  Eigen::Vector2d half = Eigen::Vector2d::Zero();
  std::vector<std::string> fiducials;
  for (const auto& [id, tag] : map.tags) {
    const char* family = nullptr;
    for (const auto& [text, known] : kFamilies)
      if (known == id.family) family = text;
    if (family == nullptr)
      return fail(ErrorCode::Unsupported,
                  fmt::format("Limelight does not support the family of {}", to_string(id)));
    const Eigen::Matrix4d T =
        SE3(tag.map_T_tag.rotation() * wpilib_R_tag().inverse(), tag.map_T_tag.translation()).matrix();
    std::vector<std::string> numbers;
    for (Eigen::Index row = 0; row < 4; ++row)
      for (Eigen::Index column = 0; column < 4; ++column) numbers.push_back(yaml_number(T(row, column)));
    half = half.cwiseMax(tag.map_T_tag.translation().head<2>().cwiseAbs());
    fiducials.push_back(
        fmt::format("    {{\n      \"family\": \"{}\",\n      \"id\": {},\n      \"size\": {},\n      "
                    "\"transform\": [{}],\n"
                    "      \"unique\": true\n    }}",
                    family, id.number, yaml_number(tag.size_m / kMillimetre), fmt::join(numbers, ", ")));
  }
  const FieldSize size = field.value_or(FieldSize{2 * half.x(), 2 * half.y()});
  return fmt::format(
      "{{\n  \"type\": \"frc\",\n  \"fieldlength\": {},\n  \"fieldwidth\": {},\n  \"fiducials\": [\n{}\n  "
      "]\n}}\n",
      yaml_number(size.length_m), yaml_number(size.width_m), fmt::join(fiducials, ",\n"));
}

namespace {

constexpr double kInch_m = 0.0254;
constexpr int kCodes = 587;  // number of codes in tag36h11

/// The first line in lower case and without spaces.
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
    const auto p = pose->read_at("translation", read_xyz);
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

std::string note_of_assumed_size(const std::string& source, double size_m) {
  return fmt::format("{} does not contain the tag size; assumed {} m (set `tag_size_m`)", source, size_m);
}

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
    return fail(ErrorCode::NotFound, "the layout has no tags", {.source = source});
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

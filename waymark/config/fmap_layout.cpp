#include "waymark/config/fmap_layout.hpp"

#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/config/json_text.hpp"
#include "waymark/config/yaml_cursor.hpp"
#include "waymark/config/yaml_write.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {
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
  return at.fail_here(ErrorCode::Unsupported, fmt::format("'{}' is no family that is known here", *name),
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
  if (!is_tag_size(kMillimetre * *size_mm))
    return entry.at("size")->fail_here(ErrorCode::InvalidArgument, "a tag has a size greater than 0");
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
  if (map.tags.empty()) return fail(ErrorCode::NotFound, "this field map has no tags", {.source = source});
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
                  fmt::format("Limelight has no name for the family of {}", to_string(id)));
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

}  // namespace waymark

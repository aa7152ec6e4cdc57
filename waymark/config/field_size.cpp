#include "waymark/config/field_size.hpp"

#include "waymark/config/json_text.hpp"
#include "waymark/config/yaml_cursor.hpp"

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

}  // namespace waymark

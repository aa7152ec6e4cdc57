#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/config/field_size.hpp"
#include "waymark/samples/tag_map.hpp"

/// Layouts of the fields of WPILib (docs/formats/map.md, "Maps of others"): JSON with `tags` and `field`, or
/// the CSV it is made of (ID, X, Y, Z in inches, rotations in degrees). Their tags have x out of the tag
/// towards the reader, y to the reader's right and z up; they are turned where they are read and written.
namespace waymark {

/// Side of the black square of the 36h11 tags of these fields (6.5 in); layouts do not say it.
inline constexpr double kWpilibTagSize_m = 0.1651;

/// Whether the text is such a layout, JSON or CSV.
[[nodiscard]] bool looks_like_wpilib_layout(std::string_view text);

/// Its tags, all of family tag36h11. Errors have file, line and key.
[[nodiscard]] Result<TagMap> parse_wpilib_layout(std::string_view text, const std::string& source,
                                                 std::optional<double> tag_size_m = {});

/// As JSON. Unless `field` is given, the length and width of the field are those of the box the tags stand
/// in.
[[nodiscard]] std::string to_wpilib_layout(const TagMap& map, const std::optional<FieldSize>& field = {});

}  // namespace waymark

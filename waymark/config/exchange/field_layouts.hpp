#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// Length (along x) and width of a field, as layouts of WPILib and field maps of Limelight state it.
struct FieldSize {
  double length_m = 0;
  double width_m = 0;

  friend bool operator==(const FieldSize&, const FieldSize&) = default;
};

/// Of a layout of WPILib or a field map of Limelight (JSON). Nothing where it states none, or one that is not
/// greater than 0.
[[nodiscard]] std::optional<FieldSize> field_size_of(std::string_view json);

// Field maps of Limelight (FMAP): JSON with `fiducials`, each with family, id, size [mm] and a 4x4 transform
// by rows [m]. Axes of tags are those of WPILib's layouts; their origin is where the file has it, for FRC
// fields the middle of the field.

/// Axes of WPILib's and Limelight's tags seen from ours: x right is their y, y down their -z, z into the tag
/// their -x.
[[nodiscard]] SO3 wpilib_R_tag();

[[nodiscard]] bool looks_like_fmap(std::string_view text);

/// Its tags, with their families and sizes. Errors have file, line and key: an unknown family, a transform
/// that is no pose, a tag that is given twice.
[[nodiscard]] Result<TagMap> parse_fmap(std::string_view text, const std::string& source);

/// Unless `field` is given, `fieldlength` and `fieldwidth` are those of the box about the origin that holds
/// all tags. Fails on a family that Limelight has no name for.
[[nodiscard]] Result<std::string> to_fmap(const TagMap& map, const std::optional<FieldSize>& field = {});

// Layouts of the fields of WPILib (docs/formats/map.md, "Maps of others"): JSON with `tags` and `field`, or
// the CSV it is made of (ID, X, Y, Z in inches, rotations in degrees). Their tags have x out of the tag
// towards the reader, y to the reader's right and z up; they are turned where they are read and written.

/// Side of the black square of the 36h11 tags of these fields (6.5 in); layouts do not say it.
inline constexpr double kWpilibTagSize_m = 0.1651;

/// Reports that the file does not contain the size of its tags, and which one is assumed.
[[nodiscard]] std::string note_of_assumed_size(const std::string& source, double size_m);

/// Whether the text is such a layout, JSON or CSV.
[[nodiscard]] bool looks_like_wpilib_layout(std::string_view text);

/// Its tags, all of family tag36h11. Errors have file, line and key.
[[nodiscard]] Result<TagMap> parse_wpilib_layout(std::string_view text, const std::string& source,
                                                 std::optional<double> tag_size_m = {});

/// As JSON. Unless `field` is given, the length and width of the field are those of the box the tags stand
/// in.
[[nodiscard]] std::string to_wpilib_layout(const TagMap& map, const std::optional<FieldSize>& field = {});

}  // namespace waymark

#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// Length (along x) and width of a field, as given in WPILib layouts and Limelight field maps.
struct FieldSize {
  double length_m = 0;
  double width_m = 0;

  friend bool operator==(const FieldSize&, const FieldSize&) = default;
};

/// The field size in a WPILib layout or a Limelight field map (JSON). Empty if it is missing or not positive.
[[nodiscard]] std::optional<FieldSize> field_size_of(std::string_view json);

// Limelight field maps (FMAP): JSON with `fiducials`, each with family, id, size [mm] and a row-major 4x4
// transform [m]. Tag axes are those of WPILib layouts. The origin is that of the file; for FRC fields it is
// the centre of the field.

/// Rotation from Waymark's tag axes to those of WPILib and Limelight: x (right) is their y, y (down) their
/// -z, z (into the tag) their -x.
[[nodiscard]] SO3 wpilib_R_tag();

[[nodiscard]] bool looks_like_fmap(std::string_view text);

/// The tags with their families and sizes. Fails with file, line and key on an unknown family, an invalid
/// transform or a duplicate tag.
[[nodiscard]] Result<TagMap> parse_fmap(std::string_view text, const std::string& source);

/// Unless `field` is given, `fieldlength` and `fieldwidth` are those of the box around the origin that
/// contains all tags. Fails on a family that Limelight does not support.
[[nodiscard]] Result<std::string> to_fmap(const TagMap& map, const std::optional<FieldSize>& field = {});

// WPILib field layouts (docs/formats/map.md, "Maps of others"): JSON with `tags` and `field`, or the CSV from
// which it is generated (ID, X, Y, Z in inches, rotations in degrees). In their tag frames, x points out of
// the tag towards the viewer, y to the viewer's right and z up; the frames are converted on reading and
// writing.

/// Side of the black square of the 36h11 tags on these fields (6.5 in); layouts do not contain it.
inline constexpr double kWpilibTagSize_m = 0.1651;

/// Reports that the file does not specify the tag size, and which size is assumed.
[[nodiscard]] std::string note_of_assumed_size(const std::string& source, double size_m);

/// Whether the text is such a layout, JSON or CSV.
[[nodiscard]] bool looks_like_wpilib_layout(std::string_view text);

/// The tags, all of family tag36h11. Errors contain file, line and key.
[[nodiscard]] Result<TagMap> parse_wpilib_layout(std::string_view text, const std::string& source,
                                                 std::optional<double> tag_size_m = {});

/// Writes JSON. Unless `field` is given, the field has the length and width of the bounding box of the tags.
[[nodiscard]] std::string to_wpilib_layout(const TagMap& map, const std::optional<FieldSize>& field = {});

}  // namespace waymark

#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/config/field_size.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/samples/tag_map.hpp"

/// Field maps of Limelight (FMAP): JSON with `fiducials`, each with family, id, size [mm] and a 4x4 transform
/// by rows [m]. Axes of tags are those of WPILib's layouts; their origin is where the file has it, for FRC
/// fields the middle of the field.
namespace waymark {

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

}  // namespace waymark

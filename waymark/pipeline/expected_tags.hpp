#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/localization/method.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/tags/tag_tracker.hpp"

namespace waymark {

/// Map tags that a detector should reliably find in an image taken from this pose, unless something else
/// occludes them. They are large enough, not viewed obliquely, and not behind another map tag. O(tags +
/// visible tags^2).
[[nodiscard]] std::vector<ExpectedTag> expected_tags(const TagMap& map, const CameraModel& camera,
                                                     const SE3& map_T_cam);

/// Map tags that should appear in the current image from a camera, according to an estimate of the robot's
/// pose: those that are large enough and not viewed obliquely. Empty if the estimate is uncertain by more
/// than a few centimetres or older than 0.5 s. O(tags).
[[nodiscard]] std::vector<ExpectedTag> expected_tags(const TagMap& map, const MountedCamera& camera,
                                                     const std::optional<LocalizationEstimate>& estimate,
                                                     SensorTime stamp);

/// Returns a text such as "2 too faint, 1 blurred"; empty if there are no counts.
[[nodiscard]] std::string counted_reasons(const std::map<MissReason, int>& counts);
/// Returns a text such as "3 expected tags were not found (2 too faint, 1 blurred)"; empty if `missed` is
/// empty.
[[nodiscard]] std::string describe(std::span<const MissedTag> missed);

}  // namespace waymark

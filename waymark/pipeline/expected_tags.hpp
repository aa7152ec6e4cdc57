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

/// Where the tags of a map should be in a picture that was taken from this pose: those that a detector finds
/// without fail when nothing is in the way, as they are large enough, not oblique, and no other tag of the
/// map hangs before them. O(tags), and O(tags in view^2).
[[nodiscard]] std::vector<ExpectedTag> expected_tags(const TagMap& map, const CameraModel& camera,
                                                     const SE3& map_T_cam);

/// Where the tags of a map should be in a picture of a camera that is taken now, by an estimate of where the
/// robot is: those that are large enough and not oblique. None where that is not certain to a few
/// centimetres, or older than half a second. O(tags).
[[nodiscard]] std::vector<ExpectedTag> expected_tags(const TagMap& map, const MountedCamera& camera,
                                                     const std::optional<LocalizationEstimate>& estimate,
                                                     SensorTime stamp);

/// "2 too faint, 1 blurred"; empty for none.
[[nodiscard]] std::string counted_reasons(const std::map<MissReason, int>& counts);
/// "3 tags that should be in view were not found (2 too faint, 1 blurred)"; empty for none.
[[nodiscard]] std::string describe(std::span<const MissedTag> missed);

}  // namespace waymark

#pragma once

#include <nlohmann/json_fwd.hpp>

#include "waymark/robots/process/message_fields.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A tag of a line `detections`. What is wrong with it is said to the fields.
[[nodiscard]] TagDetection detection_of(MessageFields& fields, const nlohmann::json& tag);
/// A tag of a line `tag_poses`; likewise.
[[nodiscard]] SeenTagPose tag_pose_of(MessageFields& fields, const nlohmann::json& tag);

}  // namespace waymark

#pragma once

#include <string>

#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Extrinsics as TagSLAM writes and reads them (camera_poses.yaml): with the square root of their
/// information.
[[nodiscard]] std::string to_tagslam_camera_poses(const SceneMap& map);
/// Bodies and their tags as TagSLAM writes and reads them (the `bodies` of tagslam.yaml): poses with standard
/// deviations, tag frames turned back into TagSLAM's. Tags that are not placed are left out.
[[nodiscard]] std::string to_tagslam_poses(const SceneMap& map);

}  // namespace waymark

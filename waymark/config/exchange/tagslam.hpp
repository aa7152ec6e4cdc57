#pragma once

#include <filesystem>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"

namespace waymark {

/// A folder as TagSLAM (Pfrommer and Daniilidis, "TagSLAM: Robust SLAM with Fiducial Markers", 2019) reads
/// it: tagslam.yaml (bodies, tags, measurements), cameras.yaml (intrinsics, topics, wiggle),
/// camera_poses.yaml (extrinsics with priors; may be missing). Without a tagslam.yaml, config.json holds all
/// of it in one (docs/formats/tagslam.md). Tag frames become ours (turned by pi about x), corner numbers too;
/// pixel centres gain 1/2. Ids beyond tag36h11 make the family tagStandard41h12, the only one of that size.
/// Keys we have no use for are passed over. Errors have file, line and key.
[[nodiscard]] Result<TagScene> read_tagslam_folder(const std::filesystem::path& folder);

/// Extrinsics as TagSLAM writes and reads them (camera_poses.yaml): with the square root of their
/// information.
[[nodiscard]] std::string to_tagslam_camera_poses(const SceneMap& map);
/// Bodies and their tags as TagSLAM writes and reads them (the `bodies` of tagslam.yaml): poses with standard
/// deviations, tag frames turned back into TagSLAM's. Tags that are not placed are left out.
[[nodiscard]] std::string to_tagslam_poses(const SceneMap& map);

}  // namespace waymark

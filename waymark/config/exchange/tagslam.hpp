#pragma once

#include <filesystem>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"

namespace waymark {

/// Reads a TagSLAM folder (Pfrommer and Daniilidis, "TagSLAM: Robust SLAM with Fiducial Markers", 2019):
/// tagslam.yaml (bodies, tags, measurements), cameras.yaml (intrinsics, topics, wiggle), camera_poses.yaml
/// (extrinsics with priors; optional). Without tagslam.yaml, config.json contains everything
/// (docs/formats/tagslam.md). Tag frames are converted (rotated by pi about x), as are corner numbers; 1/2 is
/// added to pixel centres. If ids exceed those of tag36h11, the family is tagStandard41h12, the only one with
/// that many ids. Unused keys are ignored. Errors contain file, line and key.
[[nodiscard]] Result<TagScene> read_tagslam_folder(const std::filesystem::path& folder);

/// Writes extrinsics in TagSLAM's format (camera_poses.yaml), with the square root of their information
/// matrix.
[[nodiscard]] std::string to_tagslam_camera_poses(const SceneMap& map);
/// Writes bodies and their tags in TagSLAM's format (the `bodies` of tagslam.yaml): poses with standard
/// deviations, and tag frames converted back. Tags without a pose are omitted.
[[nodiscard]] std::string to_tagslam_poses(const SceneMap& map);

}  // namespace waymark

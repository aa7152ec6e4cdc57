#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/mapping/scene/scene_values.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"

namespace waymark {

/// Reads detections and odometry of a scene from a recording of any format: cameras by the topic of their
/// detections (or the only topic of detections, for the only camera), odometry by its child frame. `problems`
/// receives damage. Fails if a camera's topic is missing; the error names the existing ones.
[[nodiscard]] Result<SceneRecording> read_scene_recording(const std::filesystem::path& path,
                                                          const TagScene& scene, const JobControl& control,
                                                          std::vector<std::string>& problems);

/// Another solution (docs/formats/tagslam.md): ref_static.csv `parent,child,px,py,pz,qx,qy,qz,qw` with
/// TagSLAM's tag frames, and ref_trajectory.csv `t_ns,body,px,…,qw,…`.
[[nodiscard]] Result<SceneValues> read_scene_values(const std::filesystem::path& folder,
                                                    const TagScene& scene);

}  // namespace waymark

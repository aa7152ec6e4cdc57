#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/mapping/scene/scene_values.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"

namespace waymark {

/// Reads the detections and odometry for a scene from a recording in any format except CSV. Cameras are
/// identified by their detection topics. If there is only one camera and only one such topic, the names may
/// differ. Bodies are identified by the child frame of the odometry. Damage in the recording is appended to
/// `problems`. Fails if the topic of a camera is missing; the hint lists the existing topics.
[[nodiscard]] Result<SceneRecording> read_scene_recording(const std::filesystem::path& path,
                                                          const TagScene& scene, const JobControl& control,
                                                          std::vector<std::string>& problems);

/// Reads a solution from another program (docs/formats/tagslam.md): ref_static.csv
/// `parent,child,px,py,pz,qx,qy,qz,qw` with TagSLAM's tag frames, and ref_trajectory.csv
/// `t_ns,body,px,…,qw,…`. Either file may be compressed (.gz, .bz2, .zst).
[[nodiscard]] Result<SceneValues> read_scene_values(const std::filesystem::path& folder,
                                                    const TagScene& scene);

}  // namespace waymark

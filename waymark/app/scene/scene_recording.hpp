#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/mapping/scene/scene_values.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"

namespace waymark {

/// Reads detections and odometry of a scene from a recording in any format except CSV. The detection topic
/// identifies the camera; if there is only one camera and one such topic, their names may differ. The child
/// frame of the odometry identifies the body. Damage in the recording is appended to `problems`. Fails if a
/// camera's topic is missing; the hint lists the existing topics.
[[nodiscard]] Result<SceneRecording> read_scene_recording(const std::filesystem::path& path,
                                                          const TagScene& scene, const JobControl& control,
                                                          std::vector<std::string>& problems);

/// Reads another solution (docs/formats/tagslam.md): ref_static.csv `parent,child,px,py,pz,qx,qy,qz,qw` with
/// TagSLAM's tag frames, and ref_trajectory.csv `t_ns,body,px,…,qw,…`. Either may be compressed (.gz, .bz2,
/// .zst).
[[nodiscard]] Result<SceneValues> read_scene_values(const std::filesystem::path& folder,
                                                    const TagScene& scene);

}  // namespace waymark

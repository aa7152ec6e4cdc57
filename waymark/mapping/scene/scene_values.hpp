#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "waymark/mapping/scene/scene_map.hpp"

/// Comparison with a solution of a scene by another program.
namespace waymark {

struct SceneValues {
  std::map<std::string, SE3> cameras{};                                 ///< body_T_cam by name
  std::map<std::string, SE3> static_bodies{};                           ///< map_T_body by name
  std::map<int, SE3> tags{};                                            ///< body_T_tag (our frame) by id
  std::map<std::pair<std::string, std::int64_t>, SE3> moving_bodies{};  ///< map_T_body by name and stamp [ns]
};

/// Keeps the frames for which the other solution has a pose; all frames if it has fewer than ten (the poses
/// are then free).
void restrict_to(const SceneValues& values, SceneRecording& recording);

struct CostAtValues {
  double cost = 0;     ///< of the model tagslam, half the sum of squared residuals
  int free_poses = 0;  ///< not in the values; estimated at the minimum of the cost
  double reprojection_mean_px = 0, reprojection_median_px = 0;
};

/// The cost of TagSLAM's model at the values. Poses that are not in the values (wiggling cameras, tags that
/// were not published) are free, and the same search estimates them. Fails if map_scene() fails.
[[nodiscard]] Result<CostAtValues> cost_at(const SceneValues& values, TagScene scene,
                                           const SceneRecording& recording,
                                           const SceneMapOptions& options = {});

}  // namespace waymark

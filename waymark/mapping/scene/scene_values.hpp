#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "waymark/mapping/scene/scene_map.hpp"

/// Comparison with another program's solution of a scene.
namespace waymark {

struct SceneValues {
  std::map<std::string, SE3> cameras{};        ///< body_T_cam for each camera name
  std::map<std::string, SE3> static_bodies{};  ///< map_T_body for each body name
  std::map<int, SE3> tags{};                   ///< body_T_tag (in our tag frame) for each id
  /// map_T_body for each body name and stamp [ns].
  std::map<std::pair<std::string, std::int64_t>, SE3> moving_bodies{};
};

/// Keeps the frames for which the other solution has a pose; if there are fewer than ten, keeps all frames
/// (their poses are then free).
void restrict_to(const SceneValues& values, SceneRecording& recording);

struct CostAtValues {
  double cost = 0;  ///< half the sum of squared residuals of the model tagslam
  /// Number of poses that are not in the values; they are estimated at the minimum of the cost.
  int free_poses = 0;
  double reprojection_mean_px = 0, reprojection_median_px = 0;
};

/// The cost of TagSLAM's model at the given values. Poses that are missing from the values (wiggling cameras,
/// tags that were not published) are free and are estimated by the same search. Fails if map_scene() fails.
[[nodiscard]] Result<CostAtValues> cost_at(const SceneValues& values, TagScene scene,
                                           const SceneRecording& recording,
                                           const SceneMapOptions& options = {});

}  // namespace waymark

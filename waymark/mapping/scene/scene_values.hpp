#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "waymark/mapping/scene/scene_map.hpp"

/// Somebody else's solution of a scene, held against ours.
namespace waymark {

struct SceneValues {
  std::map<std::string, SE3> cameras{};                                 ///< body_T_cam by name
  std::map<std::string, SE3> static_bodies{};                           ///< map_T_body by name
  std::map<int, SE3> tags{};                                            ///< body_T_tag (our frame) by id
  std::map<std::pair<std::string, std::int64_t>, SE3> moving_bodies{};  ///< map_T_body by name and stamp [ns]
};

/// Leaves the frames the other solution has a pose of; all, when it kept fewer than ten: then they are free.
void restrict_to(const SceneValues& values, SceneRecording& recording);

struct CostAtValues {
  double cost = 0;     ///< of model tagslam, half the sum of squares
  int free_poses = 0;  ///< that the values do not have; they stand where the cost is least
  double reprojection_mean_px = 0, reprojection_median_px = 0;
};

/// The cost of TagSLAM's model at the values. What they do not have (cameras that wiggle, tags it did not
/// publish) is free and found by the same search. Fails as map_scene does.
[[nodiscard]] Result<CostAtValues> cost_at(const SceneValues& values, TagScene scene,
                                           const SceneRecording& recording,
                                           const SceneMapOptions& options = {});

}  // namespace waymark

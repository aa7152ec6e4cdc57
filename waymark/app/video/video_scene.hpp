#pragma once

#include <map>
#include <set>
#include <vector>

#include "waymark/app/video/map_video.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"

/// Prior knowledge of the place of a video, as a scene.
namespace waymark::internal {

inline constexpr std::size_t kWalls = 0;  ///< the body that the tags are on
inline constexpr std::size_t kHand = 1;   ///< the body that carries the camera

/// Definition of the map frame: tags with known poses, within their standard deviations.
struct VideoAnchors {
  std::map<TagId, ScenePrior> tags{};
  std::set<TagId> exact{};  ///< those with exactly known poses
  TagId first{};            ///< what the map is named after
  bool assumed = false;     ///< one tag, upright at the origin
};

/// Fails on tags that were not observed, and on anchors without a pose. `count`: observations per tag.
[[nodiscard]] Result<VideoAnchors> video_anchors(const MapVideoJob& job, const std::map<TagId, int>& count);

/// The camera is fixed to the moving body; the tags are static. Fails if a tag that a measurement
/// names was not observed, and on a tag without a size.
[[nodiscard]] Result<TagScene> video_scene(const MapVideoJob& job, const std::map<TagId, int>& count,
                                           const VideoAnchors& anchors);

}  // namespace waymark::internal

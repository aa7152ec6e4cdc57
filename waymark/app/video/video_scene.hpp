#pragma once

#include <map>
#include <set>
#include <vector>

#include "waymark/app/video/map_video.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"

/// What is known of the place of a video beforehand, as a scene.
namespace waymark::internal {

inline constexpr std::size_t kWalls = 0;  ///< the body that the tags are on
inline constexpr std::size_t kHand = 1;   ///< the body that carries the camera

/// Where the map stands: tags whose places are known, within their standard deviations.
struct VideoAnchors {
  std::map<TagId, ScenePrior> tags{};
  std::set<TagId> exact{};  ///< of them: stand exactly where they are said to stand
  TagId first{};            ///< what the map is named after
  bool assumed = false;     ///< one tag, upright at the origin
};

/// Fails on tags that were not seen, and on anchors without a place. `count`: tags, how often seen.
[[nodiscard]] Result<VideoAnchors> video_anchors(const MapVideoJob& job, const std::map<TagId, int>& count);

/// The camera is where the hand is; what it looks at stands still. Fails where a tag that a measurement
/// names was not seen, and on a tag without a size.
[[nodiscard]] Result<TagScene> video_scene(const MapVideoJob& job, const std::map<TagId, int>& count,
                                           const VideoAnchors& anchors);

}  // namespace waymark::internal

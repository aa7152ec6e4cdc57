#pragma once

#include <map>
#include <set>
#include <vector>

#include "waymark/app/video/map_video.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"

/// The scene of a video: anchors and other prior knowledge of the place.
namespace waymark::internal {

inline constexpr std::size_t kWalls = 0;  ///< the body to which the tags are attached
inline constexpr std::size_t kHand = 1;   ///< the body that carries the camera

/// Definition of the map frame: tags whose poses are known to within their standard deviations.
struct VideoAnchors {
  std::map<TagId, ScenePrior> tags{};
  std::set<TagId> exact{};  ///< anchors with exact poses
  TagId first{};            ///< the anchor stored in the map file
  bool assumed = false;     ///< whether a single tag is assumed to be upright at the origin
};

/// Chooses the anchors and their poses. Fails if an anchor was not observed, or if its pose is unknown.
/// `count` is the number of observations of each tag.
[[nodiscard]] Result<VideoAnchors> video_anchors(const MapVideoJob& job, const std::map<TagId, int>& count);

/// Builds the scene. The camera is attached to the moving body, and the tags to the static one. Fails if a
/// tag in a measurement was not observed, or if a tag has no size.
[[nodiscard]] Result<TagScene> video_scene(const MapVideoJob& job, const std::map<TagId, int>& count,
                                           const VideoAnchors& anchors);

}  // namespace waymark::internal

#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"
#include "waymark/mapping/solver/bundle.hpp"

namespace waymark {

/// A tag observation in use.
struct SceneObservation {
  std::size_t frame = 0, camera = 0;
  std::size_t body = 0, tag = 0;  ///< TagScene::bodies[body].tags[tag]
  CornerFactor factor{};
};

/// Observations in use, and counts of ignored detections.
struct SceneObservations {
  std::vector<SceneObservation> seen{};
  std::map<TagId, int> foreign{};  ///< number of detections of each id that belongs to no body
  int squashed = 0;                ///< excluded by request, too small, or too many corrected bits
  int repeated = 0;                ///< the id occurred twice in one view
  int broken = 0;                  ///< non-finite corners
};

/// Selects detections by the lists of the scene; adds tags found on bodies that accept unlisted ids to
/// `scene`.
[[nodiscard]] SceneObservations observations_of(const SceneRecording& recording, TagScene& scene);

/// The scene as a least-squares problem. Initial poses are the means of their priors, otherwise identity.
struct SceneBundle {
  Bundle bundle{};
  std::vector<PoseIndex> cameras{};  ///< body_T_cam
  std::vector<std::vector<PoseIndex>>
      bodies{};                                ///< map_T_body: one for a static body, otherwise one per frame
  std::vector<std::vector<PoseIndex>> tags{};  ///< body_T_tag by body and tag
  std::vector<char> moves{};                   ///< by pose: it belongs to a single frame

  [[nodiscard]] PoseIndex body_at(std::size_t body, std::size_t frame) const {
    return bodies[body].size() == 1 ? bodies[body].front() : bodies[body][frame];
  }
};

/// Creates one corner term per observation, in the same order, and terms for priors, distances, coordinates
/// and the motion between frames. Without any prior on a pose in the map, fixes the first static body at the
/// origin of the map. If no tag on that body has a prior either, also fixes the tag with the most
/// observations. Fails without a static body and a prior.
[[nodiscard]] Result<SceneBundle> scene_bundle(const TagScene& scene, const SceneRecording& recording,
                                               const SceneObservations& observations);

/// Gives each camera with wiggle its own pose in each frame in which it observed a tag, tied to its pose on
/// the body, as TagSLAM does. Requires all poses to be near their final values.
void add_wiggle(const TagScene& scene, const SceneObservations& observations, SceneBundle& problem);

/// Constrains tags in one plane to the pose of that plane, which is a further unknown. Requires all poses to
/// be near their final values, and all tags of a plane to be on one body.
void add_planes(const TagScene& scene, SceneBundle& problem, std::vector<char>& placed);

}  // namespace waymark

#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"
#include "waymark/mapping/solver/bundle.hpp"

namespace waymark {

/// One tag in one view that counts.
struct SceneObservation {
  std::size_t frame = 0, camera = 0;
  std::size_t body = 0, tag = 0;  ///< TagScene::bodies[body].tags[tag]
  CornerFactor factor{};
};

/// Which detections count, and what became of the others.
struct SceneObservations {
  std::vector<SceneObservation> seen{};
  std::map<TagId, int> foreign{};  ///< ids that belong to no body: how often seen
  int squashed = 0;                ///< by request, too small, too many bits corrected
  int repeated = 0;                ///< the id was there twice in one view
  int broken = 0;                  ///< corners that are no numbers
};

/// Decides by the lists of the scene; tags found on bodies that take them are added to `scene`.
[[nodiscard]] SceneObservations observations_of(const SceneRecording& recording, TagScene& scene);

/// The scene as a least-squares problem. Values of poses are priors' means, else identity.
struct SceneBundle {
  Bundle bundle{};
  std::vector<PoseIndex> cameras{};              ///< body_T_cam
  std::vector<std::vector<PoseIndex>> bodies{};  ///< map_T_body: one of a static body, else one a frame
  std::vector<std::vector<PoseIndex>> tags{};    ///< body_T_tag by body and tag
  std::vector<char> moves{};                     ///< of each pose: it is of one frame

  [[nodiscard]] PoseIndex body_at(std::size_t body, std::size_t frame) const {
    return bodies[body].size() == 1 ? bodies[body].front() : bodies[body][frame];
  }
};

/// One corner term for each observation in the same order, priors, distances, coordinates, and the motion
/// between frames. Where no prior says where anything is, the first static body is held at the origin of the
/// map, and if no tag on it is known, so is the tag seen most. Fails when there is no static body and nothing
/// is known.
[[nodiscard]] Result<SceneBundle> scene_bundle(const TagScene& scene, const SceneRecording& recording,
                                               const SceneObservations& observations);

/// Lets each camera that may wiggle have a pose of its own in each frame it saw something, tied to the one it
/// has on its body: what TagSLAM does. Call it when all poses stand near where they belong.
void add_wiggle(const TagScene& scene, const SceneObservations& observations, SceneBundle& problem);

/// Ties tags that lie in one plane to a pose of that plane, another unknown. Call it when all poses stand
/// near where they belong. Tags of one plane must be on one body.
void add_planes(const TagScene& scene, SceneBundle& problem, std::vector<char>& placed);

}  // namespace waymark

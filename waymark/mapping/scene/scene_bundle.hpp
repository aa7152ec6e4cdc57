#pragma once

#include <cstddef>
#include <cstdint>
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
  std::size_t body = 0, tag = 0;  ///< the tag is TagScene::bodies[body].tags[tag]
  CornerFactor factor{};
};

/// Observations in use, and counts of ignored detections.
struct SceneObservations {
  std::vector<SceneObservation> seen{};
  std::map<TagId, int> foreign{};  ///< number of detections for each id that belongs to no body
  int squashed = 0;                ///< excluded on request, too small, or with too many corrected bits
  int repeated = 0;                ///< ignored, with an id that occurred twice in one view
  int broken = 0;                  ///< with non-finite corners
  int unreliable = 0;              ///< with unreliable corners
};

/// Which detections count if an id occurs at several places in one view.
enum class RepeatedIds : std::uint8_t {
  First,  ///< the first one
  All,    ///< all of them, if at least four views show the id at several places; otherwise, the first one
};

/// Selects detections according to the lists in the scene. Adds tags that are found on bodies accepting
/// unlisted ids to `scene`.
[[nodiscard]] SceneObservations observations_of(const SceneRecording& recording, TagScene& scene,
                                                RepeatedIds repeated = RepeatedIds::First);

/// Measured motion of a body between two successive frames with odometry.
struct OdometryStep {
  std::size_t term = 0;          ///< index into Bundle::relatives
  std::size_t from = 0, to = 0;  ///< frames
};

/// The scene as a least-squares problem. Initial poses are the means of their priors or, without a prior, the
/// identity.
struct SceneBundle {
  Bundle bundle{};
  std::vector<PoseIndex> cameras{};  ///< body_T_cam
  std::vector<std::vector<PoseIndex>>
      bodies{};  ///< map_T_body: one pose for a static body, otherwise one for each frame
  std::vector<std::vector<PoseIndex>> tags{};     ///< body_T_tag for each body and tag
  std::vector<std::vector<std::size_t>> sizes{};  ///< index into Bundle::sizes for each body and tag
  std::vector<char> moves{};                      ///< for each pose, whether it belongs to a single frame
  std::vector<OdometryStep> odometry{};           ///< for one body after the other, in order of time

  [[nodiscard]] PoseIndex body_at(std::size_t body, std::size_t frame) const {
    return bodies[body].size() == 1 ? bodies[body].front() : bodies[body][frame];
  }
};

/// Creates one corner term for each observation, in the same order, and terms for priors, distances,
/// coordinates and the motion between frames. Without any prior on a pose in the map, fixes the first static
/// body at the origin of the map. If no tag on that body has a prior either, also fixes the tag with the most
/// observations. Fails if there is neither a static body nor a prior.
[[nodiscard]] Result<SceneBundle> scene_bundle(const TagScene& scene, const SceneRecording& recording,
                                               const SceneObservations& observations);

/// Adds a separate pose for each camera with wiggle in each frame in which it observed a tag. The pose is
/// tied to the camera's pose on the body, as in TagSLAM. Requires all poses to be near their final values.
void add_wiggle(const TagScene& scene, const SceneObservations& observations, SceneBundle& problem);

/// Constrains tags in one plane to the pose of that plane, which is an additional unknown. Requires all poses
/// to be near their final values, and all tags of a plane to be on one body.
void add_planes(const TagScene& scene, SceneBundle& problem, std::vector<char>& placed);

}  // namespace waymark

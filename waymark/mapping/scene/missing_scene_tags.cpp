#include "waymark/mapping/scene/missing_scene_tags.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "waymark/mapping/scene/moved_tags.hpp"
#include "waymark/mapping/solver/missing_tags.hpp"

namespace waymark {
namespace {

/// Observations by frame and camera.
using ObservationsByView = std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>>;

ObservationsByView observations_by_view(const SceneMap& map) {
  ObservationsByView views;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i)
    views[{map.observations.seen[i].frame, map.observations.seen[i].camera}].push_back(i);
  return views;
}

/// The detections as recorded, which include those that the map ignores, and those that it uses with another
/// id.
std::vector<DetectedTag> detected_tags(const SceneMap& map, const SceneView& view,
                                       const std::vector<std::size_t>& observations) {
  std::vector<DetectedTag> detected;
  detected.reserve(view.detections.size() + observations.size());
  for (const TagDetection& seen : view.detections)
    detected.push_back({seen.tag, center_px(seen.corners_px), false});
  for (const std::size_t i : observations) {
    const SceneObservation& seen = map.observations.seen[i];
    detected.push_back({map.scene.bodies[seen.body].tags[seen.tag].id, center_px(seen.factor.corners_px),
                        map.problem.bundle.corners[i].used});
  }
  return detected;
}

std::vector<PlacedImage> placed_images(const SceneRecording& recording, const SceneMap& map) {
  ObservationsByView observations = observations_by_view(map);
  std::vector<PlacedImage> images;
  for (std::size_t f = 0; f < recording.frames.size(); ++f) {
    for (const SceneView& view : recording.frames[f].views) {
      const PoseIndex rig = map.problem.body_at(map.scene.cameras[view.camera].body, f);
      const PoseIndex cam = map.problem.cameras[view.camera];
      if (map.placed[rig] == 0 || map.placed[cam] == 0) continue;
      PlacedImage image = placed_image(map.problem.bundle.poses[rig].value, map.covariance.poses[rig]);
      image.camera = view.camera;
      image.time_s = to_seconds(recording.frames[f].stamp - recording.frames.front().stamp);
      image.map_T_cam = image.map_T_cam * map.problem.bundle.poses[cam].value;
      image.detected = detected_tags(map, view, observations[{f, view.camera}]);
      images.push_back(std::move(image));
    }
  }
  return images;
}

/// Whether a tag was also observed elsewhere, but never while it was in its place. This is reported as a
/// second tag with its id or as a move.
bool was_elsewhere_at_another_time(const SceneMap& map, const TagId& tag) {
  return std::ranges::any_of(map.duplicate_tags, [&](const DuplicateTag& duplicate) {
    return duplicate.tag == tag && duplicate.one_after_the_other;
  });
}

}  // namespace

std::vector<MissingTag> missing_scene_tags(const SceneRecording& recording, const SceneMap& map) {
  std::vector<CameraModel> cameras;
  cameras.reserve(map.scene.cameras.size());
  for (const CameraOnBody& camera : map.scene.cameras) cameras.push_back(camera.model);
  std::vector<PlacedTag> tags;
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t) {
      const SceneTag& tag = map.scene.bodies[b].tags[t];
      const MovedTag* moved = find_moved(map, tag.id);
      if (const auto place = map.map_T_tag(b, t))
        tags.push_back({tag.id, *place, tag.size_m, moved != nullptr ? moved->first_after_s : 0, {}});
    }
  }
  std::vector<MissingTag> missing = missing_tags(cameras, placed_images(recording, map), tags);
  std::erase_if(missing, [&](const MissingTag& tag) { return was_elsewhere_at_another_time(map, tag.tag); });
  return missing;
}

}  // namespace waymark

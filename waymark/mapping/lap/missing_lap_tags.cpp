#include "waymark/mapping/lap/missing_lap_tags.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "waymark/mapping/solver/missing_tags.hpp"

namespace waymark::internal {
namespace {

/// Whether each detection of each frame is in use.
std::vector<std::vector<char>> used_detections(const LapInput& input, const LapBundle& lap) {
  std::vector<std::vector<char>> used;
  used.reserve(input.frames.size());
  for (const TagFrame& frame : input.frames) used.emplace_back(frame.detections.size(), 0);
  for (std::size_t i = 0; i < lap.observations.size(); ++i) {
    const auto [frame, detection] = lap.observations[i];
    used[frame][detection] = lap.bundle.corners[i].used ? 1 : 0;
  }
  return used;
}

std::vector<PlacedImage> placed_images(const LapInput& input, const LapBundle& lap,
                                       const BundleCovariance& P) {
  const std::vector<std::vector<char>> used = used_detections(input, lap);
  std::vector<PlacedImage> images;
  for (std::size_t f = 0; f < input.frames.size(); ++f) {
    if (!lap.bases[f]) continue;
    const TagFrame& frame = input.frames[f];
    const std::size_t camera = camera_index(input, frame.camera);
    const SE3& base_T_cam = lap.bundle.poses[lap.cam_at(camera)].value;
    PlacedImage image = placed_image(lap.bundle.poses[*lap.bases[f]].value, P.poses[*lap.bases[f]]);
    image.camera = camera;
    image.time_s = to_seconds(frame.stamp - input.frames.front().stamp);
    image.map_T_cam = image.map_T_cam * base_T_cam;
    for (std::size_t d = 0; d < frame.detections.size(); ++d)
      image.detected.push_back(
          {frame.detections[d].tag, center_px(frame.detections[d].corners_px), used[f][d] != 0});
    images.push_back(std::move(image));
  }
  return images;
}

/// The tags that each tag of an extended map is tied to there. Most of them were observed together; if a tag
/// between them was removed, they may not have been.
std::map<TagId, std::vector<TagId>> neighbours_in_prior(const LapInput& input) {
  std::map<TagId, std::vector<TagId>> neighbours;
  if (!input.prior) return neighbours;
  for (const auto& [id, tag] : input.prior->map.tags) {
    if (!tag.tie) continue;
    neighbours[id].push_back(tag.tie->to);
    neighbours[tag.tie->to].push_back(id);
  }
  return neighbours;
}

}  // namespace

std::vector<MissingTag> missing_lap_tags(const LapInput& input, const LapBundle& lap,
                                         const BundleCovariance& P, const BundleMap& map) {
  std::map<TagId, std::vector<TagId>> neighbours = neighbours_in_prior(input);
  std::vector<PlacedTag> tags;
  for (const auto& [id, tag] : map.map.tags) {
    const auto moved = std::ranges::find(map.moved_tags, id, &MovedTag::tag);
    const double since_s = moved == map.moved_tags.end() ? 0 : moved->first_after_s;
    tags.push_back({id, tag.map_T_tag, tag.size_m, since_s, neighbours[id]});
  }
  return missing_tags(lap.bundle.cameras, placed_images(input, lap, P), tags);
}

void drop_tags_observed_elsewhere(const std::vector<SecondPlace>& places, std::vector<MissingTag>& missing) {
  for (const SecondPlace& place : places) {
    if (!place.one_after_the_other || place.is_before_move) continue;
    std::erase_if(missing, [&](const MissingTag& tag) { return tag.tag == place.tag; });
  }
}

}  // namespace waymark::internal

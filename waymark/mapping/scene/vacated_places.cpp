#include "waymark/mapping/scene/vacated_places.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <utility>

#include "waymark/mapping/solver/missing_tags.hpp"

namespace waymark {
namespace {

/// The images that show tags of one body, in its frame.
class ImagesOfBody {
 public:
  ImagesOfBody(const SceneMap& map, const ObservationTimes& times, const IdPlaces& id) : map_(map), id_(id) {
    std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> views;  // by frame and camera
    for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
      const SceneObservation& seen = map.observations.seen[i];
      if (seen.body == id.body) views[{seen.frame, seen.camera}].push_back(i);
    }
    for (const auto& [view, observations] : views) add(view.first, view.second, times, observations);
    for (const CameraOnBody& camera : map.scene.cameras) cameras_.push_back(camera.model);
    for (std::size_t t = 0; t < map.problem.tags[id.body].size(); ++t) {
      if (t != id.tag && map.placed[map.problem.tags[id.body][t]] != 0)
        tags_.push_back(placed_tag(t, map.problem.tags[id.body][t]));
    }
  }

  /// Whether the place was in view after its last observation, in the images up to this frame.
  [[nodiscard]] bool is_vacated_after(const IdPlace& place, std::size_t last_frame) const {
    const auto end = std::ranges::upper_bound(frames_, last_frame) - frames_.begin();
    return is_missing({images_.begin(), images_.begin() + end}, place);
  }

  /// Whether the place was in view before its first observation, in the images from this frame on.
  [[nodiscard]] bool is_vacated_before(const IdPlace& place, std::size_t first_frame) const {
    const auto begin = std::ranges::lower_bound(frames_, first_frame) - frames_.begin();
    std::vector<PlacedImage> reversed(images_.begin() + begin, images_.end());
    std::ranges::reverse(reversed);
    const double last_s = reversed.empty() ? 0 : reversed.front().time_s;
    for (PlacedImage& image : reversed) image.time_s = last_s - image.time_s;
    return is_missing(reversed, place);
  }

 private:
  void add(std::size_t frame, std::size_t camera, const ObservationTimes& times,
           const std::vector<std::size_t>& observations) {
    const PoseIndex body = map_.problem.body_at(id_.body, frame);
    const std::vector<BundlePose>& poses = map_.problem.bundle.poses;
    const auto used = std::ranges::find_if(observations, [&](std::size_t i) {
      const CornerTerm& term = map_.problem.bundle.corners[i];
      return term.used && map_.is_placed(term);
    });
    if (used == observations.end() || map_.placed[body] == 0) return;
    const CornerTerm& shown = map_.problem.bundle.corners[*used];
    PlacedImage image{.camera = camera, .time_s = times.frame_s[frame]};
    image.map_T_cam = poses[body].value.inverse() * poses[shown.rig].value * poses[shown.cam].value;
    for (const std::size_t i : observations) {
      const SceneObservation& seen = map_.observations.seen[i];
      image.detected.push_back({map_.scene.bodies[seen.body].tags[seen.tag].id,
                                center_px(seen.factor.corners_px), map_.problem.bundle.corners[i].used});
    }
    images_.push_back(std::move(image));
    frames_.push_back(frame);
  }

  [[nodiscard]] PlacedTag placed_tag(std::size_t tag, PoseIndex pose) const {
    const SceneTag& listed = map_.scene.bodies[id_.body].tags[tag];
    return {.tag = listed.id, .map_T_tag = map_.problem.bundle.poses[pose].value, .size_m = listed.size_m};
  }

  /// The tags whose passes show how often tags near the place are detected.
  [[nodiscard]] std::vector<PlacedTag> tags_near(const SE3& body_T_place) const {
    constexpr std::size_t kMaxTags = 30;  // limits the time
    std::vector<PlacedTag> tags = tags_;
    std::ranges::stable_sort(tags, {}, [&](const PlacedTag& tag) {
      return (tag.map_T_tag.translation() - body_T_place.translation()).norm();
    });
    tags.resize(std::min(tags.size(), kMaxTags));
    return tags;
  }

  [[nodiscard]] bool is_missing(const std::vector<PlacedImage>& images, const IdPlace& place) const {
    const PlacedTag at_place = placed_tag(id_.tag, place.pose);
    std::vector<PlacedTag> tags = tags_near(at_place.map_T_tag);
    tags.push_back(at_place);
    const std::vector<MissingTag> missing = missing_tags(cameras_, images, tags);
    return std::ranges::any_of(missing, [&](const MissingTag& tag) {
      return tag.tag == at_place.tag && tag.last_seen_s.has_value();
    });
  }

  const SceneMap& map_;
  const IdPlaces& id_;
  std::vector<CameraModel> cameras_{};
  std::vector<PlacedImage> images_{};  ///< ascending in time
  std::vector<std::size_t> frames_{};  ///< of these images
  std::vector<PlacedTag> tags_{};      ///< the other tags of the body
};

/// First and last frame of successive observations of a place without one of the other place.
struct Stay {
  bool at_first = false;
  std::size_t from = 0, to = 0;
};

/// The stays at two places, the longest first.
std::vector<Stay> stays_at(const std::vector<std::size_t>& first, const std::vector<std::size_t>& second) {
  std::vector<std::pair<std::size_t, bool>> both;
  for (const std::size_t frame : first) both.emplace_back(frame, true);
  for (const std::size_t frame : second) both.emplace_back(frame, false);
  std::ranges::sort(both);
  std::vector<Stay> stays;
  for (const auto& [frame, at_first] : both) {
    if (stays.empty() || stays.back().at_first != at_first) stays.push_back({at_first, frame, frame});
    stays.back().to = frame;
  }
  std::ranges::stable_sort(stays, std::greater<>{}, [](const Stay& stay) { return stay.to - stay.from; });
  return stays;
}

}  // namespace

bool was_vacated(const SceneMap& map, const ObservationTimes& times, const IdPlaces& id, const IdPlace& first,
                 const IdPlace& second) {
  constexpr std::size_t kMaxStays = 4;
  const std::vector<std::size_t> frames = frames_of(map, first);
  const std::vector<std::size_t> others = frames_of(map, second);
  if (frames.empty() || others.empty()) return false;
  const ImagesOfBody images(map, times, id);
  if (are_apart_in_time(frames, others)) {
    const bool in_order = is_earlier(frames, others);
    const std::size_t last = std::max(frames.back(), others.back());
    return images.is_vacated_after(in_order ? first : second, last) ||
           images.is_vacated_before(in_order ? second : first, 0);
  }
  std::vector<Stay> stays = stays_at(frames, others);
  stays.resize(std::min(stays.size(), kMaxStays));
  return std::ranges::any_of(stays, [&](const Stay& stay) {
    const IdPlace& elsewhere = stay.at_first ? second : first;
    return images.is_vacated_after(elsewhere, stay.to) || images.is_vacated_before(elsewhere, stay.from);
  });
}

}  // namespace waymark

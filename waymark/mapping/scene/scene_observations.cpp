#include <algorithm>
#include <chrono>
#include <optional>
#include <set>

#include "waymark/base/order_statistics.hpp"
#include "waymark/mapping/scene/scene_bundle.hpp"

namespace waymark {
namespace {

double area_px2(const TagDetection& detection) {
  double twice = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& a = detection.corners_px[i];
    const Eigen::Vector2d& b = detection.corners_px[(i + 1) % 4];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return std::abs(twice) / 2;
}

/// Tags by id, with those found on the way.
class Owners {
 public:
  explicit Owners(TagScene& scene) : scene_(scene) {
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
      for (std::size_t t = 0; t < scene.bodies[b].tags.size(); ++t)
        owner_.try_emplace(scene.bodies[b].tags[t].id.number, b, t);
      ignored_.insert(scene.bodies[b].ignored.begin(), scene.bodies[b].ignored.end());
    }
  }

  [[nodiscard]] bool ignored(int id) const { return ignored_.contains(id); }

  std::optional<std::pair<std::size_t, std::size_t>> find(const TagId& id) {
    const auto it = owner_.find(id.number);
    if (it != owner_.end()) return it->second;
    if (!scene_.default_body) return std::nullopt;
    SceneBody& body = scene_.bodies[*scene_.default_body];
    if (!(body.default_tag_size_m > 0)) return std::nullopt;
    body.tags.push_back({.id = id, .size_m = body.default_tag_size_m});
    return owner_[id.number] = {*scene_.default_body, body.tags.size() - 1};
  }

 private:
  TagScene& scene_;
  std::map<int, std::pair<std::size_t, std::size_t>> owner_;
  std::set<int> ignored_;
};

/// The frame that each squash is about: the nearest to its time, at most half a frame away; nothing where it
/// has no time.
std::vector<std::optional<SensorTime>> stamps_of_squashes(const SceneRecording& recording,
                                                          const TagScene& scene) {
  const std::vector<SceneFrame>& frames = recording.frames;
  std::vector<Duration> steps;
  for (std::size_t i = 1; i < frames.size(); ++i) steps.push_back(frames[i].stamp - frames[i - 1].stamp);
  const Duration half = steps.empty() ? Duration::zero() : median(std::move(steps)) / 2;
  std::vector<std::optional<SensorTime>> stamps;
  for (const SceneSquash& squash : scene.squash) {
    stamps.push_back(squash.stamp);
    if (!squash.stamp || frames.empty()) continue;
    const auto nearest = std::ranges::min_element(
        frames, {}, [&](const SceneFrame& frame) { return std::chrono::abs(frame.stamp - *squash.stamp); });
    if (std::chrono::abs(nearest->stamp - *squash.stamp) <= half) stamps.back() = nearest->stamp;
  }
  return stamps;
}

bool squashed(const TagScene& scene, const std::vector<std::optional<SensorTime>>& stamps,
              const std::string& camera, SensorTime stamp, int id) {
  for (std::size_t i = 0; i < scene.squash.size(); ++i) {
    const SceneSquash& squash = scene.squash[i];
    if ((!stamps[i] || *stamps[i] == stamp) && (squash.camera.empty() || squash.camera == camera) &&
        squash.ids.contains(id))
      return true;
  }
  return false;
}

int remapped(const TagScene& scene, const std::string& camera, SensorTime stamp, int id) {
  constexpr Duration kRounding = std::chrono::microseconds(1);  // of seconds that went through a double
  for (const SceneRemap& remap : scene.remaps) {
    if (remap.id == id && stamp >= remap.from - kRounding && stamp <= remap.to + kRounding &&
        (remap.camera.empty() || remap.camera == camera))
      return remap.becomes;
  }
  return id;
}

}  // namespace

SceneObservations observations_of(const SceneRecording& recording, TagScene& scene) {
  SceneObservations result;
  Owners owners(scene);
  const std::vector<std::optional<SensorTime>> squashes = stamps_of_squashes(recording, scene);
  for (std::size_t f = 0; f < recording.frames.size(); ++f) {
    const SceneFrame& frame = recording.frames[f];
    for (const SceneView& view : frame.views) {
      const std::string& camera = scene.cameras[view.camera].name;
      std::set<int> there;
      for (const TagDetection& detection : view.detections) {
        if (detection.hamming > scene.max_hamming ||
            squashed(scene, squashes, camera, frame.stamp, detection.tag.number) ||
            area_px2(detection) < scene.min_tag_area_px2) {
          ++result.squashed;
          continue;
        }
        const TagId id{detection.tag.family, remapped(scene, camera, frame.stamp, detection.tag.number)};
        if (owners.ignored(id.number)) {
          ++result.squashed;
          continue;
        }
        const auto owner = owners.find(id);
        if (!owner) {
          ++result.foreign[id];
          continue;
        }
        const SceneBody& body = scene.bodies[owner->first];
        if (body.max_hamming && detection.hamming > *body.max_hamming) {
          ++result.squashed;
          continue;
        }
        if (!there.insert(id.number).second) {
          ++result.repeated;
          continue;
        }
        TagDetection named = detection;
        named.tag = id;
        const auto factor = corner_factor(named, body.tags[owner->second].size_m, scene.pixel_sigma_px);
        if (!factor) {
          ++result.broken;
          continue;
        }
        result.seen.push_back({f, view.camera, owner->first, owner->second, *factor});
      }
    }
  }
  return result;
}

}  // namespace waymark

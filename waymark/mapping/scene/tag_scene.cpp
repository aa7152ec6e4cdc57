#include "waymark/mapping/scene/tag_scene.hpp"

#include <algorithm>
#include <cstdlib>
#include <set>

#include <Eigen/Cholesky>

#include "waymark/base/order_statistics.hpp"

namespace waymark {
namespace {

using StampedView = std::pair<SensorTime, SceneView>;

std::vector<SceneFrame> group_exactly(std::vector<StampedView> views) {
  std::vector<SceneFrame> frames;
  for (StampedView& view : views) {
    if (frames.empty() || frames.back().stamp != view.first) frames.push_back({view.first, {}});
    frames.back().views.push_back(std::move(view.second));
  }
  return frames;
}

/// Half the median frame period of the first camera.
Duration half_a_period(const std::vector<SceneFrame>& frames) {
  std::vector<Duration> steps;
  for (std::size_t i = 1; i < frames.size(); ++i) steps.push_back(frames[i].stamp - frames[i - 1].stamp);
  return median(std::move(steps)) / 2;
}

std::vector<SceneFrame> group_nearly(std::vector<StampedView> views) {
  std::size_t first = views.front().second.camera;
  for (const StampedView& view : views) first = std::min(first, view.second.camera);
  std::vector<SceneFrame> frames;
  std::vector<StampedView> others;
  for (StampedView& view : views) {
    if (view.second.camera == first)
      frames.push_back({view.first, {std::move(view.second)}});
    else
      others.push_back(std::move(view));
  }
  const Duration limit = half_a_period(frames);
  std::map<std::pair<std::size_t, std::size_t>, std::pair<Duration, std::size_t>> nearest;
  for (std::size_t i = 0; i < others.size(); ++i) {
    auto after = std::ranges::lower_bound(frames, others[i].first, {}, &SceneFrame::stamp);
    if (after == frames.end() ||
        (after != frames.begin() && others[i].first - (after - 1)->stamp < after->stamp - others[i].first))
      --after;
    const Duration off = std::chrono::abs(after->stamp - others[i].first);
    if (off > limit) continue;
    const std::pair key{static_cast<std::size_t>(after - frames.begin()), others[i].second.camera};
    const auto [it, fresh] = nearest.try_emplace(key, off, i);
    if (!fresh && off < it->second.first) it->second = {off, i};
  }
  for (const auto& [key, value] : nearest)
    frames[key.first].views.push_back(std::move(others[value.second].second));
  return frames;
}

}  // namespace

ScenePrior ScenePrior::of(const SE3& mean, const Eigen::Vector3d& sigma_m, const Eigen::Vector3d& sigma_rad) {
  ScenePrior prior{.mean = mean};
  Vector6 inverse;
  inverse << sigma_m.cwiseInverse(), sigma_rad.cwiseInverse();
  prior.sqrt_information = inverse.asDiagonal();
  return prior;
}

PosePriorFactor ScenePrior::factor() const { return {mean, sqrt_information * mean.inverse().adjoint()}; }

Matrix6 ScenePrior::covariance() const {
  const Matrix6 information = sqrt_information.transpose() * sqrt_information + 1e-6 * Matrix6::Identity();
  const Matrix6 Ad = mean.adjoint();
  return Ad * information.llt().solve(Matrix6::Identity()) * Ad.transpose();
}

std::optional<std::size_t> TagScene::body_named(const std::string& name) const {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].name == name) return i;
  }
  return std::nullopt;
}

namespace {

/// Calls visit() with the id of each listed tag and each detection.
template <class Visit>
void for_ids(TagScene& scene, SceneRecording& recording, Visit&& visit) {
  for (SceneBody& body : scene.bodies) {
    for (SceneTag& tag : body.tags) visit(tag.id, false);
  }
  for (SceneFrame& frame : recording.frames) {
    for (SceneView& view : frame.views) {
      for (TagDetection& detection : view.detections) visit(detection.tag, true);
    }
  }
}

}  // namespace

void unify_family(TagScene& scene, SceneRecording& recording) {
  std::set<FamilyId> families;
  int largest = -1;
  for_ids(scene, recording, [&](const TagId& id, bool detected) {
    if (detected) families.insert(id.family);
    largest = std::max(largest, id.number);
  });
  if (families.size() > 1) return;
  const bool named = !families.empty() && *families.begin() != FamilyId::Tag36h11;
  const FamilyId family = named ? *families.begin() : usual_family(largest);
  for_ids(scene, recording, [&](TagId& id, bool) {
    if (exists({family, id.number})) id.family = family;
  });
}

std::vector<SceneFrame> group_views(std::vector<std::pair<SensorTime, SceneView>> views, bool approximate) {
  std::ranges::stable_sort(views, [](const StampedView& a, const StampedView& b) {
    return std::pair(a.first, a.second.camera) < std::pair(b.first, b.second.camera);
  });
  if (views.empty()) return {};
  return approximate ? group_nearly(std::move(views)) : group_exactly(std::move(views));
}

}  // namespace waymark

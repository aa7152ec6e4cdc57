#include "waymark/mapping/scene/scene_values.hpp"

#include <algorithm>
#include <set>

#include "waymark/mapping/scene/place_poses.hpp"
#include "waymark/mapping/scene/scene_report.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMinPosesToSelect = 10;

/// Fixes the poses that are given in the values; the others stay free.
void fix_given_poses(const SceneValues& values, const SceneRecording& recording, SceneMap& map) {
  SceneBundle& problem = map.problem;
  const auto set = [&](PoseIndex pose, const SE3& value) { problem.bundle.poses[pose] = {value, true}; };
  for (std::size_t c = 0; c < map.scene.cameras.size(); ++c) {
    const auto it = values.cameras.find(map.scene.cameras[c].name);
    if (it != values.cameras.end()) set(problem.cameras[c], it->second);
  }
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    const SceneBody& body = map.scene.bodies[b];
    const auto it = values.static_bodies.find(body.name);
    if (body.is_static && it != values.static_bodies.end()) set(problem.bodies[b].front(), it->second);
    for (std::size_t t = 0; t < body.tags.size(); ++t) {
      const auto tag = values.tags.find(body.tags[t].id.number);
      if (tag != values.tags.end()) set(problem.tags[b][t], tag->second);
    }
    for (std::size_t f = 0; !body.is_static && f < recording.frames.size(); ++f) {
      const auto at =
          values.moving_bodies.find({body.name, recording.frames[f].stamp.time_since_epoch().count()});
      if (at != values.moving_bodies.end()) set(problem.bodies[b][f], at->second);
    }
  }
}

}  // namespace

void restrict_to(const SceneValues& values, SceneRecording& recording) {
  std::set<std::int64_t> stamps;
  for (const auto& [key, pose] : values.moving_bodies) stamps.insert(key.second);
  if (stamps.size() >= kMinPosesToSelect) {
    std::erase_if(recording.frames, [&](const SceneFrame& frame) {
      return !stamps.contains(frame.stamp.time_since_epoch().count());
    });
  }
}

Result<CostAtValues> cost_at(const SceneValues& values, TagScene scene, const SceneRecording& recording,
                             const SceneMapOptions& options) {
  SceneMap map{.scene = std::move(scene)};
  map.observations = observations_of(recording, map.scene);
  Result<SceneBundle> problem = scene_bundle(map.scene, recording, map.observations);
  if (!problem) return tl::unexpected(problem.error());
  map.problem = std::move(*problem);
  fix_given_poses(values, recording, map);
  std::vector<KnownPose> known(map.problem.bundle.poses.size());
  CostAtValues result;
  for (std::size_t i = 0; i < known.size(); ++i) {
    known[i].moves = map.problem.moves[i] != 0;
    result.free_poses += map.problem.bundle.poses[i].fixed ? 0 : 1;
  }
  map.placed = place_poses(map.problem.bundle, known);
  for (int round = 0; round < 3; ++round) {
    solve(map.problem.bundle, {.max_iterations = 15, .relative_gain = 1e-4, .robust_chi2 = 50});
    if (replace_contradicted(map.problem.bundle, map.placed, known, 50) == 0) break;
  }
  add_wiggle(map.scene, map.observations, map.problem);
  map.placed.resize(map.problem.bundle.poses.size(), 1);
  solve(map.problem.bundle, {.max_iterations = options.search.max_iterations, .relative_gain = 1e-8});
  result.cost = cost(map.problem.bundle);
  measure_reprojection(map);
  result.reprojection_mean_px = map.reprojection_mean_px;
  result.reprojection_median_px = map.reprojection_median_px;
  return result;
}

}  // namespace waymark

#include "waymark/mapping/scene/scene_report.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "waymark/base/order_statistics.hpp"
#include "waymark/mapping/scene/scene_intrinsics.hpp"
#include "waymark/mapping/scene/thin_cuts.hpp"

namespace waymark {
namespace {

void list_rejected(const SceneRecording& recording, SceneMap& map) {
  std::vector<double> chi2 = corner_chi2(map.problem.bundle);
  for (double& x : chi2) x *= map.correlated_frames;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    const SceneObservation& seen = map.observations.seen[i];
    const CornerTerm& term = map.problem.bundle.corners[i];
    const bool placed = map.placed[term.rig] != 0 && map.placed[term.cam] != 0 &&
                        map.placed[term.body] != 0 && map.placed[term.tag] != 0;
    if (!term.used && placed)
      map.rejected.push_back(
          {recording.frames[seen.frame].stamp, map.scene.bodies[seen.body].tags[seen.tag].id, chi2[i]});
  }
}

/// Tags none of whose observations is in use are not in the map.
void take_out_the_contradicted(SceneMap& map) {
  std::vector<char> seen(map.problem.bundle.poses.size(), 0);
  std::vector<char> used(map.problem.bundle.poses.size(), 0);
  for (const CornerTerm& term : map.problem.bundle.corners) {
    seen[term.tag] = 1;
    if (term.used) used[term.tag] = 1;
  }
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t) {
      const PoseIndex pose = map.problem.tags[b][t];
      if (seen[pose] == 0 || used[pose] != 0 || map.placed[pose] == 0 || map.problem.bundle.poses[pose].fixed)
        continue;
      if (map.scene.bodies[b].tags[t].body_T_tag) continue;  // what was known beforehand still is
      map.placed[pose] = 0;
      map.rejected_tags.push_back(map.scene.bodies[b].tags[t].id);
    }
  }
}

/// The observations that would have tied unplaced tags to those of the map, those in doubt too.
SceneCut cut_of(const SceneMap& map, const std::vector<TagId>& group) {
  SceneCut cut{.beyond = group};
  std::set<std::size_t> reached;
  for (const SceneObservation& seen : map.observations.seen) {
    if (std::ranges::binary_search(group, map.scene.bodies[seen.body].tags[seen.tag].id))
      reached.insert(seen.frame);
  }
  std::set<TagId> by;
  for (const SceneObservation& seen : map.observations.seen) {
    if (!reached.contains(seen.frame) || map.placed[map.problem.tags[seen.body][seen.tag]] == 0) continue;
    by.insert(map.scene.bodies[seen.body].tags[seen.tag].id);
    ++cut.observations;
  }
  cut.by.assign(by.begin(), by.end());
  return cut;
}

/// Unplaced tags that were seen in one frame hang together.
void list_unconnected(SceneMap& map) {
  std::map<TagId, std::set<std::size_t>> frames;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    const SceneObservation& seen = map.observations.seen[i];
    if (map.problem.bundle.corners[i].doubtful &&
        frames.contains(map.scene.bodies[seen.body].tags[seen.tag].id))
      continue;
    const TagId id = map.scene.bodies[seen.body].tags[seen.tag].id;
    const bool rejected = std::ranges::find(map.rejected_tags, id) != map.rejected_tags.end();
    if (map.placed[map.problem.tags[seen.body][seen.tag]] == 0 && !rejected) frames[id].insert(seen.frame);
  }
  while (!frames.empty()) {
    std::vector<TagId> group = {frames.begin()->first};
    std::set<std::size_t> reached = std::move(frames.begin()->second);
    frames.erase(frames.begin());
    for (bool grew = true; grew;) {
      grew = false;
      for (auto it = frames.begin(); it != frames.end();) {
        const bool meets =
            std::ranges::any_of(it->second, [&](std::size_t f) { return reached.contains(f); });
        if (!meets) {
          ++it;
          continue;
        }
        group.push_back(it->first);
        reached.insert(it->second.begin(), it->second.end());
        it = frames.erase(it);
        grew = true;
      }
    }
    std::ranges::sort(group);
    if (SceneCut cut = cut_of(map, group); cut.observations > 0) map.left_out_cuts.push_back(std::move(cut));
    map.unconnected.push_back(std::move(group));
  }
}

}  // namespace

void measure_reprojection(SceneMap& map) {
  std::vector<double> errors;
  const Bundle& bundle = map.problem.bundle;
  for (const CornerTerm& term : bundle.corners) {
    if (!term.used) continue;
    CornerFactor plain = term.factor;
    plain.whitening.setIdentity();
    const auto r = corner_residual(plain, bundle.cameras[term.camera],
                                   {bundle.poses[term.rig].value, bundle.poses[term.cam].value,
                                    bundle.poses[term.body].value, bundle.poses[term.tag].value});
    for (Eigen::Index k = 0; r && k < 4; ++k) errors.push_back(r->segment<2>(2 * k).norm());
  }
  if (errors.empty()) return;
  map.reprojection_mean_px =
      std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
  map.reprojection_median_px = median(std::move(errors));
}

namespace {

/// What the others hang on: tags that are known, or the one seen most.
std::set<PoseIndex> roots_of(const SceneMap& map) {
  std::vector<int> used(map.problem.bundle.poses.size(), 0);
  for (const CornerTerm& term : map.problem.bundle.corners) used[term.tag] += term.used ? 1 : 0;
  std::set<PoseIndex> roots;
  PoseIndex most = 0;
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t) {
      const PoseIndex tag = map.problem.tags[b][t];
      const bool known = map.scene.bodies[b].tags[t].body_T_tag || map.problem.bundle.poses[tag].fixed;
      if (known && used[tag] > 0) roots.insert(tag);
      if (used[tag] > used[most]) most = tag;
    }
  }
  if (roots.empty()) roots.insert(most);
  return roots;
}

void list_what_hangs_loosely(SceneMap& map) {
  std::map<PoseIndex, TagId> ids;
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t)
      ids[map.problem.tags[b][t]] = map.scene.bodies[b].tags[t].id;
  }
  for (PoseIndex pose : map.covariance.undetermined) {
    if (ids.contains(pose) && map.placed[pose] != 0) map.undetermined.push_back(ids.at(pose));
  }
  std::ranges::sort(map.undetermined);
  const auto named = [&](const std::vector<PoseIndex>& tags) {
    std::vector<TagId> names;
    for (PoseIndex tag : tags) names.push_back(ids.at(tag));
    std::ranges::sort(names);
    return names;
  };
  std::vector<char> moves = map.problem.moves;
  moves.resize(map.problem.bundle.poses.size(), 0);
  for (const ThinCut& cut : thin_cuts(map.problem.bundle, moves, roots_of(map)))
    map.thin_cuts.push_back({named(cut.beyond), named(cut.by), cut.observations});
}

}  // namespace

void report_scene(const SceneRecording& recording, SceneMap& map) {
  map.covariance = covariance(map.problem.bundle);
  for (std::size_t i = 0; i < map.by_size.size(); ++i)
    map.covariance.poses[i] += map.size_sigma * map.size_sigma * map.by_size[i] * map.by_size[i].transpose();
  report_intrinsics(map);
  measure_reprojection(map);
  list_rejected(recording, map);
  take_out_the_contradicted(map);
  list_unconnected(map);
  list_what_hangs_loosely(map);
}

}  // namespace waymark

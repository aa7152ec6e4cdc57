#include "waymark/mapping/scene/prior_checks.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <vector>

#include "waymark/mapping/solver/disjoint_sets.hpp"

namespace waymark {
namespace {

/// Sets of connected poses.
class ConnectedPoses {
 public:
  explicit ConnectedPoses(std::size_t poses) : sets_(poses), known_(poses, 0) {}

  PoseIndex set_of(PoseIndex pose) { return sets_.root(pose); }
  void connect(PoseIndex a, PoseIndex b) {
    const PoseIndex to = set_of(b);
    const PoseIndex from = set_of(a);
    known_[to] = known_[to] != 0 || known_[from] != 0 ? 1 : 0;
    sets_.join(from, to);
  }
  /// Marks a pose as determined by something other than tags.
  void mark_known(PoseIndex pose) { known_[set_of(pose)] = 1; }
  bool known(PoseIndex pose) { return known_[set_of(pose)] != 0; }

 private:
  internal::DisjointSets sets_;
  std::vector<char> known_;
};

void connect_observations(const SceneMap& map, ConnectedPoses& connected) {
  std::vector<char> moves = map.problem.moves;
  moves.resize(map.problem.bundle.poses.size(), 0);
  for (const CornerTerm& term : map.problem.bundle.corners) {
    if (!term.used) continue;
    connected.connect(term.tag, term.rig);
    if (moves[term.rig] == 0) connected.mark_known(term.rig);
    if (moves[term.body] != 0) connected.connect(term.tag, term.body);
  }
}

/// Tags on a static body that is itself an unknown connect through it.
void connect_bodies(const SceneMap& map, ConnectedPoses& connected) {
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    const PoseIndex body = map.problem.bodies[b].front();
    const bool given = map.problem.bundle.poses[body].fixed || map.scene.bodies[b].map_T_body;
    if (!map.scene.bodies[b].is_static || given) continue;
    for (const PoseIndex tag : map.problem.tags[b]) connected.connect(tag, body);
  }
}

/// Connects by all terms between two poses, except those of a camera: a common camera does not tie tags.
void connect_measurements(const SceneMap& map, ConnectedPoses& connected) {
  const Bundle& bundle = map.problem.bundle;
  const std::set<PoseIndex> cameras(map.problem.cameras.begin(), map.problem.cameras.end());
  const auto connect_all = [&](const auto& terms) {
    for (const auto& term : terms) {
      if (!cameras.contains(term.a) && !cameras.contains(term.b)) connected.connect(term.a, term.b);
    }
  };
  for (const RelativeTerm& term : bundle.relatives) {
    if (term.used && !cameras.contains(term.a) && !cameras.contains(term.b))
      connected.connect(term.a, term.b);
  }
  connect_all(bundle.pair_priors);
  connect_all(bundle.distances);
  connect_all(bundle.odometry);
  for (const PointDistanceTerm& term : bundle.point_distances) connected.connect(term.a.tag, term.b.tag);
  for (const PointCoordinateTerm& term : bundle.point_coordinates) connected.mark_known(term.point.tag);
}

}  // namespace

std::map<TagId, int> tags_on_prior_alone(const SceneMap& map) {
  const Bundle& bundle = map.problem.bundle;
  ConnectedPoses connected(bundle.poses.size());
  connect_observations(map, connected);
  connect_bodies(map, connected);
  connect_measurements(map, connected);
  std::vector<int> used(bundle.poses.size(), 0);
  for (const CornerTerm& term : bundle.corners) used[term.tag] += term.used ? 1 : 0;
  std::map<PoseIndex, int> tags_in_set;
  int tags = 0;
  for (const std::vector<PoseIndex>& of_body : map.problem.tags) {
    for (const PoseIndex tag : of_body) {
      if (map.placed[tag] == 0 || used[tag] == 0) continue;
      ++tags_in_set[connected.set_of(tag)];
      ++tags;
    }
  }
  std::map<TagId, int> alone;
  if (tags < 2) return alone;
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t) {
      const PoseIndex tag = map.problem.tags[b][t];
      if (!map.scene.bodies[b].tags[t].body_T_tag || map.placed[tag] == 0 || used[tag] == 0) continue;
      if (tags_in_set[connected.set_of(tag)] == 1 && !connected.known(tag))
        alone.emplace(map.scene.bodies[b].tags[t].id, used[tag]);
    }
  }
  return alone;
}

}  // namespace waymark

#include "waymark/mapping/scene/prior_checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>

#include "waymark/mapping/scene/moved_tags.hpp"
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
  std::set<PoseIndex> unknown;
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    const PoseIndex body = map.problem.bodies[b].front();
    const bool given = map.problem.bundle.poses[body].fixed || map.scene.bodies[b].map_T_body;
    if (!map.scene.bodies[b].is_static || given) continue;
    unknown.insert(body);
    for (const PoseIndex tag : map.problem.tags[b]) connected.connect(tag, body);
  }
  for (const CornerTerm& term : map.problem.bundle.corners) {  // also of moved and duplicate tags
    if (unknown.contains(term.body)) connected.connect(term.tag, term.body);
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
  for (const MovedTag& moved : map.moved_tags) {
    if (used[*moved.earlier] > 0) ++tags_in_set[connected.set_of(*moved.earlier)];
  }
  for (const DuplicateTag& duplicate : map.duplicate_tags) ++tags_in_set[connected.set_of(duplicate.other)];
  std::map<TagId, int> alone;
  if (tags < 2) return alone;
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t) {
      const PoseIndex tag = map.problem.tags[b][t];
      if (!map.scene.bodies[b].tags[t].body_T_tag || map.placed[tag] == 0 || used[tag] == 0) continue;
      if (find_moved(map, map.scene.bodies[b].tags[t].id) != nullptr) continue;  // not at its given pose
      if (tags_in_set[connected.set_of(tag)] == 1 && !connected.known(tag))
        alone.emplace(map.scene.bodies[b].tags[t].id, used[tag]);
    }
  }
  return alone;
}

namespace {

/// The 0.999 quantiles of chi-square with 1 to 6 degrees of freedom.
constexpr std::array kQuantiles = {10.83, 13.82, 16.27, 18.47, 20.52, 22.46};

}  // namespace

std::optional<double> contradiction_sigmas(const PosePriorFactor& given, const SE3& estimate,
                                           const Matrix6& covariance, bool used) {
  constexpr double kLeastShare = 0.01;  // of the information that does not come from the given pose
  const Vector6 r = pose_prior_residual(given, estimate);
  Matrix6 V = given.whitening * covariance * given.whitening.transpose();
  if (!used)
    V = -V;
  else if (!(V.diagonal().maxCoeff() < 1))
    V.setZero();  // an undetermined pose, or one with a common size error
  const Eigen::SelfAdjointEigenSolver<Matrix6> shares(Matrix6::Identity() - V);
  double chi2 = 0;
  std::size_t directions = 0;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double share = shares.eigenvalues()[i];
    if (share < kLeastShare) continue;
    const double along = shares.eigenvectors().col(i).dot(r);
    chi2 += along * along / share;
    ++directions;
  }
  if (directions == 0 || chi2 < kQuantiles.at(directions - 1)) return std::nullopt;
  return std::sqrt(chi2);
}

std::vector<std::size_t> sizes_far_from_given_pose(const SceneMap& map) {
  std::vector<char> observed(map.problem.bundle.poses.size(), 0);
  for (const CornerTerm& term : map.problem.bundle.corners) observed[term.tag] = 1;
  std::vector<std::pair<double, std::size_t>> far;  // negative squared residuals, and sizes
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t) {
      const std::optional<ScenePrior>& given = map.scene.bodies[b].tags[t].body_T_tag;
      const PoseIndex pose = map.problem.tags[b][t];
      if (!given || map.placed[pose] == 0 || observed[pose] == 0) continue;
      const Vector6 r = pose_prior_residual(given->factor(), map.problem.bundle.poses[pose].value);
      if (r.squaredNorm() > kQuantiles.back()) far.emplace_back(-r.squaredNorm(), map.problem.sizes[b][t]);
    }
  }
  std::ranges::sort(far);
  std::vector<std::size_t> sizes(far.size());
  std::ranges::transform(far, sizes.begin(), [](const auto& tag) { return tag.second; });
  return sizes;
}

}  // namespace waymark

#include "waymark/mapping/scene/scene_sizes.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <Eigen/Cholesky>

#include "waymark/mapping/solver/pose_votes.hpp"

namespace waymark {

std::vector<SizeObservations> observations_by_size(const SceneMap& map) {
  return observations_by_size(map.problem.bundle, map.placed);
}

std::vector<std::size_t> contradicted_sizes(const SceneMap& map) {
  return contradicted_sizes(observations_by_size(map));
}

namespace {

/// The corner terms of a tag in frames that show another tag in use.
std::vector<const CornerTerm*> terms_beside_others(const SceneMap& map, std::size_t size) {
  std::map<std::pair<PoseIndex, PoseIndex>, std::set<PoseIndex>> tags_in_use;
  for (const CornerTerm& term : map.problem.bundle.corners) {
    if (term.used) tags_in_use[{term.rig, term.body}].insert(term.tag);
  }
  std::vector<const CornerTerm*> terms;
  for (const CornerTerm& term : map.problem.bundle.corners) {
    if (term.size != size || !map.is_placed(term)) continue;
    const auto others = tags_in_use.find({term.rig, term.body});
    if (others != tags_in_use.end() && others->second.size() > others->second.count(term.tag))
      terms.push_back(&term);
  }
  return terms;
}

using Squares = std::vector<std::vector<internal::Hypothesis>>;

/// The factor to the size of a tag with which the distances in all terms lead to one place: the least-squares
/// solution of place = camera + factor * towards.
double common_factor(const Bundle& bundle, const std::vector<const CornerTerm*>& terms,
                     const Squares& squares) {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();  // of the place and the factor
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (squares[i].empty()) continue;
    const CornerPoses poses = poses_of(bundle, *terms[i]);
    const SE3 body_T_cam = poses.map_T_body.inverse() * poses.map_T_rig * poses.rig_T_cam;
    const Eigen::Vector3d towards = body_T_cam.rotation() * squares[i].front().value.translation();
    Eigen::Matrix<double, 3, 4> J;
    J << Eigen::Matrix3d::Identity(), -towards;
    J /= towards.norm();
    information += J.transpose() * J;
    gradient += J.transpose() * body_T_cam.translation() / towards.norm();
  }
  return information.ldlt().solve(gradient)[3];
}

/// The votes for the pose of the terms' tag.
std::vector<internal::Vote<SE3>> votes_for_tag(const Bundle& bundle,
                                               const std::vector<const CornerTerm*>& terms,
                                               const Squares& squares) {
  const Matrix6 known = 1e-4 * Matrix6::Identity();
  std::vector<internal::Vote<SE3>> votes;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    std::array<std::vector<internal::Hypothesis>, 4> values;
    std::array<const std::vector<internal::Hypothesis>*, 4> sets{};
    for (std::size_t role = 0; role < 4; ++role) {
      const PoseIndex pose = internal::pose_of(*terms[i], static_cast<internal::Role>(role));
      values[role] = {{bundle.poses[pose].value, known, 0}};
      sets[role] = &values[role];
    }
    internal::Vote<SE3> vote = internal::vote_for(internal::Role::Tag, sets, squares[i]);
    if (!vote.empty()) votes.push_back(std::move(vote));
  }
  return votes;
}

}  // namespace

void start_size(SceneMap& map, std::size_t size) {
  constexpr double kSigmaPx = 0.5;
  constexpr std::size_t kMinTerms = 4;
  constexpr double kMaxFactor = 2;
  Bundle& bundle = map.problem.bundle;
  const std::vector<const CornerTerm*> terms = terms_beside_others(map, size);
  if (terms.size() < kMinTerms) return;
  Squares squares;
  for (const CornerTerm* term : terms) squares.push_back(internal::poses_of_square(bundle, *term, kSigmaPx));
  const double factor = common_factor(bundle, terms, squares);
  if (!(factor > 1 / kMaxFactor && factor < kMaxFactor)) return;
  for (std::vector<internal::Hypothesis>& both : squares) {
    for (internal::Hypothesis& square : both)
      square.value = SE3(square.value.rotation(), factor * square.value.translation());
  }
  const auto votes = votes_for_tag(bundle, terms, squares);
  const auto agreed = internal::agree(votes, internal::kPoseGate);
  if (!agreed || 2 * static_cast<std::ptrdiff_t>(agreed->votes) < std::ssize(votes)) return;
  bundle.sizes[size].log_scale += std::log(factor);
  bundle.poses[terms.front()->tag].value = agreed->value.mean;
}

}  // namespace waymark

#include "waymark/mapping/scene/scene_sizes.hpp"

#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>

#include <Eigen/Cholesky>

#include "waymark/mapping/scene/tag_place.hpp"

namespace waymark {

bool SizeObservations::contradict() const {
  constexpr double kMaxRejectedShare = 0.3;
  constexpr double kMaxUnusedShare = 0.5;
  constexpr int kMinRejected = 4;
  return rejected + unconfirmed >= kMinRejected &&
         (rejected > kMaxRejectedShare * (used + rejected) || share_unused() > kMaxUnusedShare);
}

std::vector<SizeObservations> observations_by_size(const SceneMap& map) {
  std::vector<SizeObservations> sizes(map.problem.bundle.sizes.size());
  for (const CornerTerm& term : map.problem.bundle.corners) {
    if (!term.size || !map.is_placed(term)) continue;
    SizeObservations& of_tag = sizes[*term.size];
    ++(term.used ? of_tag.used : term.unconfirmed ? of_tag.unconfirmed : of_tag.rejected);
  }
  return sizes;
}

bool are_few_tags(std::size_t tags, const SceneMap& map) {
  constexpr std::size_t kMaxTags = 3;
  constexpr double kMaxShare = 0.25;
  const auto observed = std::ranges::count_if(observations_by_size(map), [](const SizeObservations& tag) {
    return tag.used + tag.rejected + tag.unconfirmed > 0;
  });
  return tags <= kMaxTags || static_cast<double>(tags) <= kMaxShare * static_cast<double>(observed);
}

std::vector<std::size_t> contradicted_sizes(const SceneMap& map) {
  const std::vector<SizeObservations> sizes = observations_by_size(map);
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (sizes[i].contradict()) found.push_back(i);
  }
  if (!are_few_tags(found.size(), map)) return {};
  std::ranges::stable_sort(found, std::greater<>{}, [&](std::size_t i) { return sizes[i].share_unused(); });
  return found;
}

namespace {

/// The factor to the size of a tag with which the distances in all terms lead to one place: the least-squares
/// solution of place = camera + factor * towards.
double common_factor(const Bundle& bundle, const std::vector<const CornerTerm*>& terms,
                     const TagSquares& squares) {
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

}  // namespace

void start_size(SceneMap& map, std::size_t size) {
  constexpr std::size_t kMinTerms = 4;
  constexpr double kMaxFactor = 2;
  Bundle& bundle = map.problem.bundle;
  const std::vector<const CornerTerm*> terms = terms_beside_others(map, size);
  if (terms.size() < kMinTerms) return;
  TagSquares squares = squares_of(bundle, terms);
  const double factor = common_factor(bundle, terms, squares);
  if (!(factor > 1 / kMaxFactor && factor < kMaxFactor)) return;
  for (std::vector<internal::Hypothesis>& both : squares) {
    for (internal::Hypothesis& square : both)
      square.value = SE3(square.value.rotation(), factor * square.value.translation());
  }
  const std::optional<SE3> place = agreed_place(bundle, terms, squares);
  if (!place) return;
  bundle.sizes[size].log_scale += std::log(factor);
  bundle.poses[terms.front()->tag].value = *place;
}

}  // namespace waymark

#include "waymark/mapping/scene/scene_sizes.hpp"

#include <cmath>
#include <cstddef>
#include <optional>

#include <Eigen/Cholesky>

#include "waymark/mapping/solver/tag_place.hpp"

namespace waymark {

std::vector<SizeObservations> observations_by_size(const SceneMap& map) {
  return observations_by_size(map.problem.bundle, map.placed);
}

std::vector<std::size_t> contradicted_sizes(const SceneMap& map) {
  return contradicted_sizes(observations_by_size(map));
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
  const std::vector<const CornerTerm*> terms = terms_beside_others(bundle, map.placed, size);
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
  BundlePose& pose = bundle.poses[terms.front()->tag];
  if (!pose.fixed) pose.value = *place;
}

}  // namespace waymark

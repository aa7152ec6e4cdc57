#include "waymark/factors/corner_factor.hpp"

#include <Eigen/Cholesky>

#include "waymark/samples/tag_sizes.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using Matrix26 = Eigen::Matrix<double, 2, 6>;

/// d(px)/d(xi) for a point that the perturbation carries: J_px_q [I, -p^], J_px_q the derivative for the
/// point in the axes of the perturbed frame, p the point there.
Matrix26 carried(const Matrix23& J_px_q, const Eigen::Vector3d& p, double sign) {
  Matrix26 J;
  J.leftCols<3>() = sign * J_px_q;
  J.rightCols<3>().noalias() = -sign * J_px_q * SO3::hat(p);
  return J;
}

}  // namespace

Result<CornerFactor> corner_factor(const TagDetection& detection, double size_m, double corner_sigma_px) {
  CornerFactor factor{.corners_px = detection.corners_px, .size_m = size_m};
  for (const Eigen::Vector2d& corner : factor.corners_px) {
    if (!corner.allFinite())
      return fail(ErrorCode::InvalidArgument, "a corner of " + to_string(detection.tag) + " is not a number");
  }
  if (!is_tag_size(size_m))
    return fail(ErrorCode::InvalidArgument, "the size of " + to_string(detection.tag) + " is not positive");
  if (!detection.corner_covariance_px2) {
    factor.whitening /= corner_sigma_px;
    return factor;
  }
  const Eigen::LLT<CornerCovariance> llt(*detection.corner_covariance_px2);
  if (llt.info() != Eigen::Success || !detection.corner_covariance_px2->allFinite())
    return fail(ErrorCode::InvalidArgument,
                "the corner covariance of " + to_string(detection.tag) + " is not positive definite");
  llt.matrixL().solveInPlace(factor.whitening);
  return factor;
}

std::optional<Eigen::Matrix<double, 8, 1>> corner_residual(const CornerFactor& factor,
                                                           const CameraModel& camera,
                                                           const CornerPoses& poses, CornerJacobians* J) {
  const SE3 cam_T_rig = poses.rig_T_cam.inverse();
  const SE3 rig_T_map = poses.map_T_rig.inverse();
  const Eigen::Matrix3d cam_R_rig = cam_T_rig.rotation().matrix();
  const Eigen::Matrix3d cam_R_map = cam_R_rig * rig_T_map.rotation().matrix();
  const Eigen::Matrix3d cam_R_body = cam_R_map * poses.map_T_body.rotation().matrix();
  const std::array<Eigen::Vector3d, 4> tag_p = tag_corners(factor.size_m);
  Eigen::Matrix<double, 8, 1> r;
  for (Eigen::Index i = 0; i < 4; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Vector3d body_p = poses.body_T_tag * tag_p[at];
    const Eigen::Vector3d map_p = poses.map_T_body * body_p;
    const Eigen::Vector3d rig_p = rig_T_map * map_p;
    Matrix23 J_px_p;
    const auto px = camera.project(cam_T_rig * rig_p, J == nullptr ? nullptr : &J_px_p);
    if (!px) return std::nullopt;
    r.segment<2>(2 * i) = *px - factor.corners_px[at];
    if (J == nullptr) continue;
    J->rig.middleRows<2>(2 * i) = carried(J_px_p * cam_R_map, map_p, -1);
    J->cam.middleRows<2>(2 * i) = carried(J_px_p * cam_R_rig, rig_p, -1);
    J->tag.middleRows<2>(2 * i) = carried(J_px_p * cam_R_body, body_p, 1);
  }
  // Products of this size go faster term by term than through the kernels for large matrices.
  const CornerCovariance& W = factor.whitening;
  if (J != nullptr) {
    J->rig = W.lazyProduct(J->rig).eval();
    J->cam = W.lazyProduct(J->cam).eval();
    J->body = -J->rig;
    J->tag = W.lazyProduct(J->tag).eval();
  }
  return W.lazyProduct(r).eval();
}

}  // namespace waymark

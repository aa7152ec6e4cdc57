#include "waymark/factors/corner_factor.hpp"

#include <Eigen/Cholesky>

#include "waymark/samples/tag_sizes.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

/// d(px)/d(xi) = J_px_q [I, -p^] for a point p that moves with the perturbed frame. J_px_q is the derivative
/// with respect to the point; both p and J_px_q are in the axes of the perturbed frame.
void carry(const Matrix23& J_px_q, const Eigen::Vector3d& p, double sign, int row,
           Eigen::Matrix<double, 8, 6>& J) {
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d a = sign * J_px_q.row(i).transpose();
    J.row(row + i) << a.transpose(), p.cross(a).transpose();
  }
}

void whiten(const CornerCovariance& W, Eigen::Matrix<double, 8, 6>& J) {
  // For products of this size, term-by-term evaluation is faster than the kernels for large matrices.
  J = W.lazyProduct(J).eval();
}

}  // namespace

Result<CornerFactor> corner_factor(const TagDetection& detection, double size_m, double default_sigma_px) {
  if (const Status status = check_usable_corners(detection); !status)
    return tl::unexpected<Error>(status.error());
  CornerFactor factor{.corners_px = detection.corners_px, .size_m = size_m};
  for (const Eigen::Vector2d& corner : factor.corners_px) {
    if (!corner.allFinite())
      return fail(ErrorCode::InvalidArgument, "non-finite corner of " + to_string(detection.tag));
  }
  if (!is_tag_size(size_m))
    return fail(ErrorCode::InvalidArgument, "the size of " + to_string(detection.tag) + " is not positive");
  if (!detection.corner_covariance_px2) {
    factor.whitening /= default_sigma_px;
    factor.isotropic = true;
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
  const Eigen::Matrix3d cam_R_rig = poses.rig_T_cam.rotation().matrix().transpose();
  const Eigen::Matrix3d rig_R_map = poses.map_T_rig.rotation().matrix().transpose();
  const Eigen::Matrix3d map_R_body = poses.map_T_body.rotation().matrix();
  const Eigen::Matrix3d body_R_tag = poses.body_T_tag.rotation().matrix();
  const double scale = factor.isotropic ? factor.whitening(0, 0) : 1;
  const std::array<Eigen::Vector3d, 4> tag_p = tag_corners(factor.size_m * poses.size_scale);
  Eigen::Matrix<double, 8, 1> r;
  for (int i = 0; i < 4; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const int row = 2 * i;
    const Eigen::Vector3d from_middle = body_R_tag * tag_p[at];
    const Eigen::Vector3d body_p = from_middle + poses.body_T_tag.translation();
    const Eigen::Vector3d map_p = map_R_body * body_p + poses.map_T_body.translation();
    const Eigen::Vector3d rig_p = rig_R_map * (map_p - poses.map_T_rig.translation());
    Matrix23 J_px_cam;
    const auto px = camera.project(cam_R_rig * (rig_p - poses.rig_T_cam.translation()),
                                   J == nullptr ? nullptr : &J_px_cam);
    if (!px) return std::nullopt;
    r.segment<2>(row) = scale * (*px - factor.corners_px[at]);
    if (J == nullptr) continue;
    const Matrix23 J_px_rig = scale * J_px_cam * cam_R_rig;
    const Matrix23 J_px_map = J_px_rig * rig_R_map;
    if (J->wants_cam) carry(J_px_rig, rig_p, -1, row, J->cam);
    if (J->wants_rig) carry(J_px_map, map_p, -1, row, J->rig);
    if (J->wants_body) carry(J_px_map, map_p, 1, row, J->body);
    if (J->wants_tag) carry(J_px_map * map_R_body, body_p, 1, row, J->tag);
    if (J->wants_size) J->size.segment<2>(row) = J_px_map * (map_R_body * from_middle);
  }
  if (factor.isotropic) return r;
  if (J != nullptr) {
    if (J->wants_rig) whiten(factor.whitening, J->rig);
    if (J->wants_cam) whiten(factor.whitening, J->cam);
    if (J->wants_body) whiten(factor.whitening, J->body);
    if (J->wants_tag) whiten(factor.whitening, J->tag);
    if (J->wants_size) J->size = factor.whitening.lazyProduct(J->size).eval();
  }
  return factor.whitening.lazyProduct(r).eval();
}

std::optional<CornerIntrinsicsJacobian> corner_intrinsics_jacobian(const CornerFactor& factor,
                                                                   const CameraModel& camera,
                                                                   const CornerPoses& poses) {
  const SE3 cam_T_tag = (poses.map_T_rig * poses.rig_T_cam).inverse() * poses.map_T_body * poses.body_T_tag;
  CornerIntrinsicsJacobian J;
  int row = 0;
  for (const Eigen::Vector3d& tag_p : tag_corners(factor.size_m * poses.size_scale)) {
    const auto J_px = intrinsics_jacobian(camera, cam_T_tag * tag_p);
    if (!J_px) return std::nullopt;
    if (row == 0) J.resize(8, J_px->cols());
    J.middleRows<2>(row) = *J_px;
    row += 2;
  }
  for (Eigen::Index i = 0; i < J.cols(); ++i) J.col(i) = factor.whitening.lazyProduct(J.col(i)).eval();
  return J;
}

}  // namespace waymark

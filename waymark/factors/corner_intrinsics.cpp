#include "waymark/factors/corner_intrinsics.hpp"

#include "waymark/samples/visibility.hpp"

namespace waymark {

std::optional<CornerIntrinsicsJacobian> corner_intrinsics_jacobian(const CornerFactor& factor,
                                                                   const CameraModel& camera,
                                                                   const CornerPoses& poses) {
  const SE3 cam_T_tag = (poses.map_T_rig * poses.rig_T_cam).inverse() * poses.map_T_body * poses.body_T_tag;
  CornerIntrinsicsJacobian J;
  int row = 0;
  for (const Eigen::Vector3d& tag_p : tag_corners(factor.size_m)) {
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

#include "waymark/factors/rolling_shutter.hpp"

#include "waymark/samples/visibility.hpp"

namespace waymark {

std::optional<Eigen::Matrix<double, 8, 1>> rolling_shift(const MovingTag& tag, const TagCorners& measured_px,
                                                         const CameraModel& camera, double readout_s,
                                                         Eigen::Matrix<double, 8, 6>* J_twist) {
  const std::array<Eigen::Vector3d, 4> tag_p = tag_corners(tag.size_m);
  Eigen::Matrix<double, 8, 1> shift;
  for (std::size_t i = 0; i < 4; ++i) {
    const double t = row_time_s(measured_px[i].y(), camera.height_px(), readout_s);
    const Vector6 xi = t * tag.twist + t * t / 2 * tag.bend;
    const Eigen::Vector3d middle = tag.cam_T_tag * tag_p[i];
    const Eigen::Vector3d then = SE3::exp(xi) * middle;
    const auto row = static_cast<Eigen::Index>(2 * i);
    Matrix23 J_px;
    const auto from = camera.project(middle);
    const auto to = camera.project(then, &J_px);
    if (!from || !to) return std::nullopt;
    shift.segment<2>(row) = *to - *from;
    if (J_twist == nullptr) continue;
    Matrix36 J_then;
    J_then << Eigen::Matrix3d::Identity(), -SO3::hat(then);
    J_twist->middleRows<2>(row) = t * J_px * J_then * SE3::left_jacobian(xi);
  }
  return shift;
}

}  // namespace waymark

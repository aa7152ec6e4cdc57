#include "waymark/pose/pose_refinement.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "waymark/pose/square_pose.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark::internal {

std::optional<Whitening> Whitening::of(const CornerCovariance& covariance_px2) {
  if (!covariance_px2.allFinite()) return std::nullopt;
  const Eigen::LLT<CornerCovariance> llt(covariance_px2);
  if (llt.info() != Eigen::Success) return std::nullopt;
  Whitening whitening;
  whitening.inverse_sigma_ = 0;
  whitening.factor_ = llt.matrixL();
  return whitening;
}

void Whitening::apply(Vector8& e, Matrix86& J) const {
  if (isotropic()) {
    J *= inverse_sigma_;
  } else {
    factor_.triangularView<Eigen::Lower>().solveInPlace(J);
  }
  apply(e);
}

void Whitening::apply(Vector8& e) const {
  if (isotropic()) {
    e *= inverse_sigma_;
  } else {
    factor_.triangularView<Eigen::Lower>().solveInPlace(e);
  }
}

void Whitening::apply_to_covariance(CornerCovariance& C) const {
  if (isotropic()) {
    C *= inverse_sigma_ * inverse_sigma_;
    return;
  }
  factor_.triangularView<Eigen::Lower>().solveInPlace(C);
  CornerCovariance transposed = C.transpose();
  factor_.triangularView<Eigen::Lower>().solveInPlace(transposed);
  C = transposed;
}

double Whitening::worst_corner_chi2(const Vector8& e) const {
  double worst = 0;
  for (int i = 0; i < 8; i += 2) {
    const Eigen::Vector2d corner = e.segment<2>(i);
    if (isotropic()) {
      worst = std::max(worst, corner.squaredNorm() * inverse_sigma_ * inverse_sigma_);
    } else {
      const Eigen::Matrix<double, 2, 8> rows = factor_.middleRows<2>(i);
      const Eigen::Matrix2d covariance = rows * rows.transpose();
      worst = std::max(worst, corner.dot(covariance.inverse() * corner));
    }
  }
  return worst;
}

void NormalEquations::add(const Vector8& e, const Matrix86& J, double weight) {
  H.noalias() += weight * J.transpose().lazyProduct(J);
  g.noalias() += weight * J.transpose().lazyProduct(e);
  chi2 += weight * e.squaredNorm();
}

bool corner_residuals(const CameraModel& camera, const Corners3& cam_corners,
                      const Eigen::Vector3d& cam_pivot, const Corners2& measured_px, Vector8& e,
                      Matrix86& J) {
  for (std::size_t i = 0; i < 4; ++i) {
    Matrix23 J_px_p;
    const std::optional<Eigen::Vector2d> px = camera.project(cam_corners[i], &J_px_p);
    if (!px) return false;
    const Eigen::Vector3d lever = cam_corners[i] - cam_pivot;
    const auto row = static_cast<Eigen::Index>(2 * i);
    e.segment<2>(row) = *px - measured_px[i];
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector3d gradient = J_px_p.row(k).transpose();
      J.row(row + k) << gradient.transpose(), lever.cross(gradient).transpose();
    }
  }
  return true;
}

std::optional<CornerCovariance> lens_residual_covariance(const CameraModel& camera,
                                                         const Corners3& cam_corners,
                                                         const IntrinsicsCovariance& intrinsics_covariance) {
  Eigen::Matrix<double, 8, Eigen::Dynamic, Eigen::ColMajor, 8, kMaxIntrinsics> J(
      8, intrinsics_covariance.rows());
  for (std::size_t i = 0; i < 4; ++i) {
    const auto J_px = intrinsics_jacobian(camera, cam_corners[i]);
    if (!J_px) return std::nullopt;
    J.middleRows<2>(static_cast<Eigen::Index>(2 * i)) = *J_px;
  }
  const CornerCovariance C = J.lazyProduct(intrinsics_covariance).eval().lazyProduct(J.transpose());
  return (C + C.transpose()) / 2;
}

namespace {

constexpr std::array<const char*, 4> kCornerNames = {"TL", "TR", "BR", "BL"};

tl::unexpected<Error> invalid(const TagDetection& detection, std::string message, std::string hint) {
  return fail(ErrorCode::InvalidArgument, std::move(message), {.key = to_string(detection.tag)},
              std::move(hint));
}

Result<Corners3> bearings_of(const TagDetection& detection, const CameraModel& camera) {
  Corners3 bearings;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& px = detection.corners_px[i];
    if (!px.allFinite()) {
      return invalid(detection, fmt::format("corner {} has a non-finite position", kCornerNames[i]),
                     "Check the source of the detection.");
    }
    const auto bearing = camera.unproject(px);
    if (!bearing) {
      return invalid(
          detection,
          fmt::format("corner {} at ({:.1f}, {:.1f}) px is outside the domain of the camera model",
                      kCornerNames[i], px.x(), px.y()),
          "Calibrate with views that reach the edges of the image, or check that the calibration belongs to "
          "this camera and resolution.");
    }
    bearings[i] = *bearing;
  }
  return bearings;
}

}  // namespace

Result<std::array<SE3, 2>> starting_poses(const TagDetection& detection, double size_m,
                                          const CameraModel& camera) {
  if (!is_tag_size(size_m)) {
    return invalid(detection, fmt::format("{} m is not a valid tag size", size_m),
                   "Pass the side of the black square in metres, measured where black meets white.");
  }
  if (const Status status = check_usable_corners(detection); !status)
    return tl::unexpected<Error>(status.error());
  const Result<Corners3> bearings = bearings_of(detection, camera);
  if (!bearings) return tl::unexpected<Error>(bearings.error());
  const SquarePoses poses = square_poses(*bearings, size_m);
  if (poses.defect != QuadDefect::None) {
    return invalid(
        detection, to_string(poses.defect),
        "Pass the corners of the printed tag in the order TL, TR, BR, BL, as seen by a viewer of the tag.");
  }
  return poses.cam_T_tag;
}

Result<Whitening> whitening_of(const TagDetection& detection, double sigma_px) {
  if (!detection.corner_covariance_px2) return Whitening(sigma_px);
  const std::optional<Whitening> whitening = Whitening::of(*detection.corner_covariance_px2);
  if (!whitening) {
    return invalid(detection, "the covariance of the corners is not finite and positive definite",
                   "Omit `corner_covariance_px2`, or check how the detector computes it.");
  }
  return *whitening;
}

}  // namespace waymark::internal

#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/mapping/camera/camera_parameters.hpp"
#include "waymark/mapping/camera/target_mark.hpp"

/// Intrinsics and the pose of every view together (Zhang, "A Flexible New Technique for Camera Calibration",
/// PAMI 2000, section 3.3), by Levenberg-Marquardt with the poses eliminated.
namespace waymark::internal {

/// Numbers of one mark: two a point, four points at most.
using MarkVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 8, 1>;
using MarkMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 8, 8>;

/// A mark of the target as one view saw it.
struct ViewMark {
  TargetMark seen{};
  MarkMatrix whitening{};  ///< L^-1 of its covariance L L^T [1/px]
  bool used = true;

  [[nodiscard]] Eigen::Index numbers() const { return 2 * std::ssize(seen.seen_px); }
};

/// The mark with its whitening; `default_sigma_px` where it has no covariance. Fails (InvalidArgument) on
/// points that are not finite and a covariance that is not positive definite.
[[nodiscard]] Result<ViewMark> view_mark(TargetMark mark, double default_sigma_px);

/// One picture of the target.
struct TargetView {
  std::vector<ViewMark> marks{};
  SE3 target_T_cam{};  ///< where the search begins, then where it ended
};

struct IntrinsicsFit {
  Eigen::VectorXd parameters{};
  Eigen::MatrixXd
      information{};  ///< of the parameters, poses eliminated, for corners as uncertain as they said
  double chi2 = 0;    ///< of the marks used, whitened
  int iterations = 0;
  bool converged = false;
};

struct FitOptions {
  LensModel lens = LensModel::Radtan4;
  int width_px = 0;
  int height_px = 0;
  int free_parameters = 1000;  ///< the first so many move, the others stay; 0: poses only
  double huber_sigma = 3;      ///< a mark whose corners are on average worse counts less; 0: all count whole
  int max_iterations = 60;
};

/// From `parameters` and the poses of the views, which move. Nothing when the start is none: a camera that
/// cannot be, or a mark used behind it. O(marks * parameters) an iteration.
[[nodiscard]] std::optional<IntrinsicsFit> fit_intrinsics(std::vector<TargetView>& views,
                                                          const Eigen::VectorXd& parameters,
                                                          const FitOptions& options);

/// Squared whitened residual of a mark; nothing when it does not project.
[[nodiscard]] std::optional<double> mark_chi2(const ViewMark& mark, const TargetView& view,
                                              const CameraModel& camera);

/// A mark's points in the camera's frame.
[[nodiscard]] std::array<Eigen::Vector3d, 4> camera_points(const ViewMark& mark, const SE3& cam_T_target);

/// Where a mark's points project; nothing when one does not.
[[nodiscard]] std::optional<MarkVector> projected(const ViewMark& mark,
                                                  const std::array<Eigen::Vector3d, 4>& cam_points,
                                                  const CameraModel& camera);

}  // namespace waymark::internal

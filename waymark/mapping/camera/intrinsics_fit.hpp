#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/mapping/camera/camera_parameters.hpp"
#include "waymark/mapping/camera/target_mark.hpp"

/// Joint estimation of intrinsics and the pose of every view (Zhang, "A Flexible New Technique for Camera
/// Calibration", PAMI 2000, section 3.3), by Levenberg-Marquardt with the poses eliminated.
namespace waymark::internal {

/// Residuals of one mark, two for each of its points (at most four).
using MarkVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 8, 1>;
using MarkMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 8, 8>;

/// An observation of one of the target's marks in a view.
struct ViewMark {
  TargetMark seen{};
  MarkMatrix whitening{};  ///< L^-1 of its covariance L L^T [1/px]
  bool used = true;

  [[nodiscard]] Eigen::Index numbers() const { return 2 * std::ssize(seen.seen_px); }
};

/// A mark together with its whitening; `default_sigma_px` is used if the mark has no covariance. Fails
/// (InvalidArgument) on non-finite points or on a covariance that is not positive definite.
[[nodiscard]] Result<ViewMark> view_mark(TargetMark mark, double default_sigma_px);

/// One image of the target.
struct TargetView {
  std::vector<ViewMark> marks{};
  SE3 target_T_cam{};  ///< the starting value for the search, then its result
};

struct IntrinsicsFit {
  Eigen::VectorXd parameters{};
  Eigen::MatrixXd
      information{};  ///< information of the parameters (poses eliminated, using the corners' covariances)
  double chi2 = 0;    ///< sum over the marks used, whitened
  int iterations = 0;
  bool converged = false;
};

struct FitOptions {
  LensModel lens = LensModel::Radtan4;
  int width_px = 0;
  int height_px = 0;
  /// Number of leading parameters to estimate; the others are fixed. If 0, only poses are estimated.
  int free_parameters = 1000;
  double huber_sigma = 3;  ///< a mark with a larger mean residual is downweighted; 0 for no downweighting
  int max_iterations = 60;
  std::function<bool()> goes_on = [] { return true; };  ///< called in each iteration; false stops the fit
};

/// Fits the intrinsics and the poses of the views, starting from `parameters` and the current poses, and
/// updates the poses. Empty if the start is invalid, that is, if the camera parameters are invalid or a mark
/// in use is behind the camera, or if the fit was stopped. O(marks * parameters) per iteration.
[[nodiscard]] std::optional<IntrinsicsFit> fit_intrinsics(std::vector<TargetView>& views,
                                                          const Eigen::VectorXd& parameters,
                                                          const FitOptions& options);

/// Squared whitened residual of a mark; empty if the mark does not project into the image.
[[nodiscard]] std::optional<double> mark_chi2(const ViewMark& mark, const TargetView& view,
                                              const CameraModel& camera);

/// The points of a mark in the camera frame.
[[nodiscard]] std::array<Eigen::Vector3d, 4> camera_points(const ViewMark& mark, const SE3& cam_T_target);

/// Projections of the points of a mark; empty if one of them does not project into the image.
[[nodiscard]] std::optional<MarkVector> projected(const ViewMark& mark,
                                                  const std::array<Eigen::Vector3d, 4>& cam_points,
                                                  const CameraModel& camera);

}  // namespace waymark::internal

#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/factors/corner_factor.hpp"
#include "waymark/mapping/calibration/camera_parameters.hpp"

/// Intrinsics and the pose of every view together (Zhang, "A Flexible New Technique for Camera Calibration",
/// PAMI 2000, section 3.3), by Levenberg-Marquardt with the poses eliminated.
namespace waymark::internal {

/// A tag of the target as one view saw it.
struct TargetTag {
  CornerFactor seen{};
  SE3 target_T_tag{};
  bool used = true;
};

/// One picture of the target.
struct TargetView {
  std::vector<TargetTag> tags{};
  SE3 target_T_cam{};  ///< where the search begins, then where it ended
};

struct IntrinsicsFit {
  Eigen::VectorXd parameters{};
  Eigen::MatrixXd
      information{};  ///< of the parameters, poses eliminated, for corners as uncertain as they said
  double chi2 = 0;    ///< of the tags used, whitened
  int iterations = 0;
  bool converged = false;
};

struct FitOptions {
  LensModel lens = LensModel::Radtan4;
  int width_px = 0;
  int height_px = 0;
  int free_parameters = 1000;  ///< the first so many move, the others stay; 0: poses only
  double huber_sigma = 3;      ///< a tag whose corners are on average worse counts less; 0: all count whole
  int max_iterations = 60;
};

/// From `parameters` and the poses of the views, which move. Nothing when the start is none: a camera that
/// cannot be, or a tag used behind it. O(tags * parameters) an iteration.
[[nodiscard]] std::optional<IntrinsicsFit> fit_intrinsics(std::vector<TargetView>& views,
                                                          const Eigen::VectorXd& parameters,
                                                          const FitOptions& options);

/// Squared whitened residual of a tag, 8 numbers; nothing when it does not project.
[[nodiscard]] std::optional<double> tag_chi2(const TargetTag& tag, const TargetView& view,
                                             const CameraModel& camera);

}  // namespace waymark::internal

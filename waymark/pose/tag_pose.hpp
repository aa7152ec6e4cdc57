#pragma once

#include <cstdint>
#include <optional>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {

/// 6x6 covariance of a pose a_T_b in its left tangent (translation, rotation) [m, rad], expressed in frame a.
using PoseCovariance = Covariance<SE3>;

struct TagPoseOptions {
  /// Default noise of a corner, for detections without a covariance (TagDetection::corner_covariance_px2
  /// takes precedence). Options with the same name elsewhere document how they differ.
  double corner_sigma_px = 0.2;
  int max_iterations = 30;
  /// Covariance of the camera parameters (intrinsics_of()), as estimated by their calibration. If it is
  /// empty, the camera is taken as exact. It changes the covariance of the pose, not the pose. Not a field.
  IntrinsicsCovariance intrinsics_covariance{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.corner_sigma_px, Field{"corner_sigma_px",
                                      "Standard deviation of a corner coordinate if the detector provides no "
                                      "covariance; raise it for blurred "
                                      "images or a rough calibration.",
                                      1e-6, 1e3});
    visit(self.max_iterations,
          Field{"max_iterations", "Maximum number of refinement steps; 5 are usual.", 1, 1000});
  }
};

/// One pose that explains the corners: a local minimum of the reprojection error, taking lens distortion into
/// account and weighted by the corner covariance. Follows Martins and Ramos, "AprilTag-based Trajectory
/// Tracking for the LIMOS Robot", equation 2.13.
struct TagPoseSolution {
  SE3 cam_T_tag{};
  double chi2 =
      0;  ///< squared residuals over their variance: 8 coordinates, 6 unknowns and thus 2 degrees of freedom
  double rms_px = 0;  ///< root mean square distance between the four corners and their projections [px]
  /// Inverse of the Fisher information that the corners provide about cam_T_tag, plus lens_covariance, in the
  /// left tangent of the camera frame. Contains the square of sigma_scale. It is of first order and does not
  /// account for the other solution.
  PoseCovariance covariance = PoseCovariance::Zero();
  /// The part of `covariance` that TagPoseOptions::intrinsics_covariance causes. An error of the lens is the
  /// same in all images of the camera, so averaging over images does not reduce this part.
  PoseCovariance lens_covariance = PoseCovariance::Zero();
  /// Factor on the standard deviations, at least 1. It is above 1 if the residuals of the best square exceed
  /// the covariances of corners and lens (wrong lens, wrong corners). Derived from the smaller chi2
  /// of the two solutions and the same for both; chi2 is not scaled.
  double sigma_scale = 1;
};

/// State of the second solution.
enum class OtherSolution : std::uint8_t {
  Found,
  SameMinimum,   ///< both starting points converge to the same minimum, because of strong perspective or a
                 ///< frontal view
  NotVisible,    ///< its corners would be behind the camera or outside the field of the lens
  NotConverged,  ///< no minimum was found from its starting point
};

/// The pose of one tag. A flat square seen with almost no perspective has two poses that fit nearly equally
/// well; they are mirror images of each other about the plane facing the camera. Noise determines which one
/// fits better (docs/concepts/pose.md, "Two poses"). Both are returned; a caller that only uses `best` makes
/// the choice.
struct TagPose {
  TagPoseSolution
      best{};  ///< the one with the smaller chi2; not necessarily the correct one, see ambiguity_ratio()
  std::optional<TagPoseSolution> other{};            ///< the one with the larger chi2
  OtherSolution other_state = OtherSolution::Found;  ///< `other` is set if Found; otherwise the reason

  /// best.rms_px / other.rms_px in [0, 1]: near 1 if the two are indistinguishable, 0 if there is no other
  /// solution.
  [[nodiscard]] double ambiguity_ratio() const;
  /// Likelihood of the corners under `other` relative to `best`: exp((best.chi2 - other.chi2) / 2) in [0, 1],
  /// or 0 if there is no other solution. Only as accurate as the corner covariance.
  [[nodiscard]] double likelihood_ratio() const;
};

/// Both poses of one tag. The two solutions of square_poses() are refined until they are minima. Does not
/// allocate; takes a few microseconds. size_m is the side of the square where the black border meets the
/// white border.
///
/// Fails if the size is not positive and finite, the covariance is not positive definite, or an option is out
/// of range. Fails if intrinsics_covariance is not finite, is not a covariance, or has another size than the
/// parameters of the camera. Also fails if the corners are unreliable, not finite, repeated, collinear, not
/// in the order TL, TR, BR, BL, or outside the domain of the lens. Never returns NaN.
[[nodiscard]] Result<TagPose> estimate_tag_pose(const TagDetection& detection, double size_m,
                                                const CameraModel& camera,
                                                const TagPoseOptions& options = {});

/// The same with the size looked up by id.
[[nodiscard]] Result<TagPose> estimate_tag_pose(const TagDetection& detection, const TagSizes& sizes,
                                                const CameraModel& camera,
                                                const TagPoseOptions& options = {});

/// Standard deviations, for display.
struct PoseDeviations {
  Eigen::Vector3d position_m;    ///< for the origin of b, along the axes of a
  Eigen::Vector3d rotation_rad;  ///< about the axes of a
};

/// Standard deviations of a_T_b computed from its covariance (left tangent in a): those of the position of
/// b's origin in a, and those of the rotation about a's axes. If b is away from a's origin, the uncertainty
/// of the position differs from that of the tangent's translation.
[[nodiscard]] PoseDeviations standard_deviations(const SE3& a_T_b, const PoseCovariance& covariance);

}  // namespace waymark

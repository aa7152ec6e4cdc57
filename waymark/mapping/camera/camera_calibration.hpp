#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/mapping/camera/camera_parameters.hpp"
#include "waymark/mapping/camera/target_mark.hpp"
#include "waymark/samples/calibration.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

struct CameraCalibrationOptions {
  /// Standard deviation of corners without a covariance (like TagPoseOptions::corner_sigma_px). It determines
  /// their weight relative to corners with a covariance; the noise scale from the residuals applies to both.
  double corner_sigma_px = 0.2;
  double gate_sigma = 4;
  double better_by = 0.02;
  int folds = 5;
  std::vector<LensModel> lenses{};  ///< candidates if no lens model is given; empty for all. Not a field
  /// Called in each iteration; if it returns false, the calibration stops and fails. Not a field.
  std::function<bool()> goes_on = [] { return true; };

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.corner_sigma_px, Field{"corner_sigma_px",
                                      "Standard deviation of a corner whose detection has no covariance; "
                                      "it is scaled by the residuals.",
                                      1e-4, 100});
    visit(self.gate_sigma,
          Field{"gate_sigma",
                "A tag or corner whose residual exceeds this many standard deviations is excluded.", 2, 1e3});
    visit(self.better_by, Field{"better_by",
                                "Relative decrease of the cross-validation error that a lens model with more "
                                "parameters must reach.",
                                0, 1});
    visit(self.folds, Field{"folds", "Number of folds of the cross-validation over images.", 2, 100});
  }
};

/// A cell of the 3 x 3 grid on the image; cells are numbered row by row from the top left.
struct ImageRegion {
  std::size_t corners = 0;
  double rms_px = 0;
  double noise_scale = 0;  ///< size of the residuals relative to the corners' covariances
};

/// The result for one image.
struct CalibratedView {
  std::size_t marks = 0;     ///< number of tags or board corners used
  std::size_t rejected = 0;  ///< number of the target's marks with excessive residuals
  double rms_px = 0;         ///< reprojection error of the corners used
  double tilt_deg = 0;       ///< angle between the optical axis and the target's normal
  double distance_m = 0;     ///< from the camera to the centroid of the points in view
  SE3 target_T_cam{};        ///< camera pose
  std::vector<bool> used{};  ///< for each mark of the image; empty if the image was not usable
};

/// Cross-validation error of a lens model.
struct LensTrial {
  LensModel lens{};
  std::optional<double> held_out_rms_px{};  ///< empty if the model could not be fitted
};

struct CameraCalibration {
  CameraModel camera;
  LensModel lens{};
  std::vector<std::string> names{};  ///< names of the parameters
  Eigen::VectorXd parameters{};
  Eigen::MatrixXd covariance{};  ///< covariance of the parameters, scaled by noise_scale
  double rms_px = 0;             ///< reprojection error of the corners used
  double held_out_rms_px = 0;    ///< reprojection error in held-out images
  double noise_scale = 1;        ///< size of the residuals relative to the corners' covariances
  /// In the order of the input; `marks` is 0 if the image was not usable.
  std::vector<CalibratedView> views{};
  std::array<ImageRegion, 9> regions{};
  std::vector<LensTrial> trials{};
  std::vector<std::string> advice{};  ///< sentences about missing images and likely causes of the residuals
};

/// Estimates the intrinsics of a camera from images of tags with known poses on a target (`target`: a printed
/// board, or any mapped tags). All corners of all images are fitted together, with outliers excluded. Each
/// image is also predicted once by a fit that excludes it. Without `lens`, selects the lens model with the
/// fewest parameters among those with nearly the smallest cross-validation error. Fails (InvalidArgument)
/// with fewer than three usable images, with images taken from one side only (focal length and distance are
/// then indistinguishable), or if the fit does not converge. O(images * tags * parameters * iterations).
[[nodiscard]] Result<CameraCalibration> calibrate_camera(const std::vector<std::vector<TagDetection>>& images,
                                                         const TagMap& target, int width_px, int height_px,
                                                         std::optional<LensModel> lens = {},
                                                         const CameraCalibrationOptions& options = {});

/// Does the same for any flat target (all points at z = 0), such as the corners of a board. An image with
/// fewer than eight points is not usable.
[[nodiscard]] Result<CameraCalibration> calibrate_camera(const std::vector<TargetMarks>& images, int width_px,
                                                         int height_px, std::optional<LensModel> lens = {},
                                                         const CameraCalibrationOptions& options = {});

/// The calibration as written to calibration.yaml.
[[nodiscard]] Calibration to_calibration(const CameraCalibration& found);

}  // namespace waymark

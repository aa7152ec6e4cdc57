#pragma once

#include <array>
#include <cstddef>
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
  /// Of corners without a covariance (as TagPoseOptions::corner_sigma_px): weighs them against those with
  /// one; the residuals scale both.
  double corner_sigma_px = 0.2;
  double gate_sigma = 4;
  double better_by = 0.02;
  int folds = 5;
  std::vector<LensModel> lenses{};  ///< to choose from where none is given; empty: all. No field

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.corner_sigma_px, Field{"corner_sigma_px",
                                      "Standard deviation of a corner whose detection has no covariance; "
                                      "what the residuals show scales it.",
                                      1e-4, 100});
    visit(self.gate_sigma,
          Field{"gate_sigma",
                "A tag or corner whose residual exceeds this many standard deviations is left out.", 2, 1e3});
    visit(self.better_by, Field{"better_by",
                                "Relative decrease of the cross-validation error that a lens model with more "
                                "parameters must reach.",
                                0, 1});
    visit(self.folds, Field{"folds", "Number of folds of the cross-validation over pictures.", 2, 100});
  }
};

/// A cell of the image, three a side, row by row from the top left.
struct ImageRegion {
  std::size_t corners = 0;
  double rms_px = 0;
  double noise_scale = 0;  ///< residuals over what the corners' covariances promised
};

/// What became of one picture.
struct CalibratedView {
  std::size_t marks = 0;     ///< tags, or corners of a board, that were used
  std::size_t rejected = 0;  ///< of the target, but too far from where they should be
  double rms_px = 0;         ///< distance of the corners used from where they project
  double tilt_deg = 0;       ///< between the optical axis and the target's normal
  double distance_m = 0;     ///< camera to the middle of what was seen
  SE3 target_T_cam{};        ///< where the camera stood
  std::vector<bool> used{};  ///< each mark of the picture; empty: the picture was of no use
};

/// How well a lens foretold pictures it was not fitted to.
struct LensTrial {
  LensModel lens{};
  std::optional<double> held_out_rms_px{};  ///< nothing: it could not be fitted
};

struct CameraCalibration {
  CameraModel camera;
  LensModel lens{};
  std::vector<std::string> names{};  ///< of the parameters
  Eigen::VectorXd parameters{};
  Eigen::MatrixXd covariance{};         ///< of the parameters, with the noise that the residuals show
  double rms_px = 0;                    ///< of the corners used
  double held_out_rms_px = 0;           ///< of pictures that the fit had not seen
  double noise_scale = 1;               ///< residuals over what the corners' covariances promised
  std::vector<CalibratedView> views{};  ///< as they were given; marks 0: the picture was of no use
  std::array<ImageRegion, 9> regions{};
  std::vector<LensTrial> trials{};
  std::vector<std::string> advice{};  ///< what more to photograph, in words; empty: nothing is missing
};

/// Finds the intrinsics of a camera from pictures of tags whose places on the target are known (`target`: a
/// printed board, or any mapped tags). All corners of all pictures are fitted together, outliers left out,
/// each picture foretold once by the others. Without `lens`, the one with the fewest numbers that foretells
/// as well as the best. Fails (InvalidArgument) with fewer than three usable pictures, all from one side (the
/// focal length cannot be told from the distance then), or a fit that does not converge. O(pictures * tags *
/// parameters * iterations).
[[nodiscard]] Result<CameraCalibration> calibrate_camera(
    const std::vector<std::vector<TagDetection>>& pictures, const TagMap& target, int width_px, int height_px,
    std::optional<LensModel> lens = {}, const CameraCalibrationOptions& options = {});

/// The same of any flat target (all its points at z = 0): the corners of a board. A picture with fewer than
/// eight points is of no use.
[[nodiscard]] Result<CameraCalibration> calibrate_camera(const std::vector<TargetPicture>& pictures,
                                                         int width_px, int height_px,
                                                         std::optional<LensModel> lens = {},
                                                         const CameraCalibrationOptions& options = {});

/// As it is written into calibration.yaml.
[[nodiscard]] Calibration to_calibration(const CameraCalibration& found);

}  // namespace waymark

#pragma once

#include <string>
#include <vector>

#include "waymark/mapping/camera/camera_calibration.hpp"
#include "waymark/mapping/camera/intrinsics_fit.hpp"

namespace waymark::internal {

/// What more to photograph: empty parts of the image, too few tilts, too few pictures, a region that fits
/// worse than the others, numbers that stay uncertain. Sentences for people.
[[nodiscard]] std::vector<std::string> calibration_advice(const CameraCalibration& found);

/// What would explain residuals that the camera and the poses leave, in words: a rolling shutter (each
/// picture is sheared and stretched as it is read), a focal length that changes from picture to picture, a
/// board that is not flat, a board whose sizes are not as given. Each is fitted to the residuals where they
/// are (linearised, the poses with it); that which earns most of chi2 by Schwarz's criterion is
/// named where it explains a tenth of it. At most one, since each explains a part of the others'
/// residuals. O(marks).
[[nodiscard]] std::vector<std::string> calibration_causes(const std::vector<TargetView>& views,
                                                          const FitOptions& options,
                                                          const Eigen::VectorXd& parameters);

}  // namespace waymark::internal

#pragma once

#include <string>
#include <vector>

#include "waymark/mapping/camera/camera_calibration.hpp"
#include "waymark/mapping/camera/intrinsics_fit.hpp"

namespace waymark::internal {

/// Advice on which further images to take, as full sentences. It covers empty parts of the image, too few
/// tilts, too few images, a region that fits worse than the others, and parameters that are still uncertain.
[[nodiscard]] std::vector<std::string> calibration_advice(const CameraCalibration& found);

/// The likely cause of the residuals that remain after the fit, as text. Possible causes are a rolling
/// shutter, a focal length that changes between images, a board that is not flat, and wrong board dimensions.
/// A rolling shutter shears and stretches each image during readout. Each cause is fitted to the residuals
/// (linearised, together with the poses). The one that Schwarz's criterion favours most is reported if it
/// explains at least a tenth of chi2. At most one cause is reported, because each of them also explains part
/// of the residuals due to the others. O(marks).
[[nodiscard]] std::vector<std::string> calibration_causes(const std::vector<TargetView>& views,
                                                          const FitOptions& options,
                                                          const Eigen::VectorXd& parameters);

}  // namespace waymark::internal

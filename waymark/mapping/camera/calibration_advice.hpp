#pragma once

#include <string>
#include <vector>

#include "waymark/mapping/camera/camera_calibration.hpp"
#include "waymark/mapping/camera/intrinsics_fit.hpp"

namespace waymark::internal {

/// Advice for further images, as full sentences. It covers empty parts of the image, too few tilts, too few
/// images, a region that fits worse than the others, and parameters that remain uncertain.
[[nodiscard]] std::vector<std::string> calibration_advice(const CameraCalibration& found);

/// Likely cause of residuals that remain after the fit, as text. Possible causes are a rolling shutter, a
/// focal length that changes between images, a board that is not flat, and wrong board dimensions. A rolling
/// shutter shears and stretches each image during readout. Each cause is fitted to the residuals (linearised,
/// together with the poses). The one that reduces chi2 most by Schwarz's criterion is reported if it explains
/// a tenth of chi2. At most one is reported, because each explains a part of the others' residuals. O(marks).
[[nodiscard]] std::vector<std::string> calibration_causes(const std::vector<TargetView>& views,
                                                          const FitOptions& options,
                                                          const Eigen::VectorXd& parameters);

}  // namespace waymark::internal

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"

namespace waymark {

/// Distortion models that a calibration can estimate.
enum class LensModel : std::uint8_t { None, Radtan4, Radtan5, Rational8, Equidistant };

/// The name of a lens model: "none", "radtan4", "radtan5", "rational8" or "equidistant".
[[nodiscard]] std::string_view to_string(LensModel lens);
[[nodiscard]] std::optional<LensModel> lens_model(std::string_view word);
[[nodiscard]] const std::vector<LensModel>& lens_models();

/// Parameter names of a lens model: fx_px, fy_px, cx_px, cy_px, followed by its coefficients ("k1", "k2",
/// "p1", …).
[[nodiscard]] std::vector<std::string> parameter_names(LensModel lens);

/// The camera with these parameters, which are in the order of parameter_names(). Fails if
/// CameraModel::make() rejects them, or if the domain of the camera does not reach an edge of the image.
[[nodiscard]] Result<CameraModel> camera_of(LensModel lens, const Eigen::VectorXd& parameters, int width_px,
                                            int height_px);

}  // namespace waymark

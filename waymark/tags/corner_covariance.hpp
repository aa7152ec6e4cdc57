#pragma once

#include <Eigen/Core>

#include "waymark/tags/tag_bands.hpp"
#include "waymark/tags/tag_fit.hpp"

namespace waymark::refinement {

using Matrix8 = Eigen::Matrix<double, 8, 8>;

/// Parameters the four edges of a tag have together, about: 8 displacements, and as many levels and blurs.
inline constexpr int kParametersOfTag = 16;

/// J_corners_displacements: how the corners (x0 y0 ... x3 y3) move with (kFrom, kTo) of the four edges. A
/// corner stays on the two edges that meet in it.
[[nodiscard]] Matrix8 intersection(const std::array<EdgeFrame, 4>& edges);

/// Covariance of the corners [px^2], positive definite: that of the least squares estimate with the noise the
/// residuals show, plus what the model leaves out. `model_error_px` is added to the place of each edge.
[[nodiscard]] Matrix8 corner_covariance(const TagSolve& solve, const TagEstimate& estimate,
                                        const TagBands& tag, double model_error_px);

}  // namespace waymark::refinement

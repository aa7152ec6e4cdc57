#pragma once

#include <cstddef>
#include <cstdint>

#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement/cell_steps.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

namespace waymark::refinement {

/// What limits the accuracy of the steps between cells if the border could not be fitted.
enum class KeptCause : std::uint8_t { TooSmall, LowContrast, PoorFit, MovedTooFar, Bent };
inline constexpr std::size_t kKeptCauses = 5;

/// The cause that an outcome other than Refined and CutByBorder implies. Bent tags are a cause of their own.
[[nodiscard]] KeptCause kept_cause(RefinementOutcome outcome, const StepPlacement& steps);

/// Covariance of corners that were moved to the steps, with the weights that tools/learn_kept_corners.py
/// learns for each cause. Positive definite.
[[nodiscard]] CornerCovariance step_covariance(KeptCause cause, const StepPlacement& steps);

/// Corners of a tag whose border could not be fitted.
struct KeptCorners {
  Quad corners_px{};
  CornerCovariance covariance_px2 = CornerCovariance::Zero();
  bool by_steps = false;  ///< moved to the steps between cells; otherwise the given corners
};

/// Moves corners to the steps between cells, unless too few steps are visible, the border of the image cuts
/// the tag, or the print is saturated, which displaces steps. `outcome` is one other than Refined.
[[nodiscard]] KeptCorners kept_corners(RefinementOutcome outcome, const PrintedTag& print,
                                       const Quad& corners_px, const StepPlacement& steps);

/// Corners that the steps contradict stay in place: their covariance contains the shift that the steps
/// suggest.
[[nodiscard]] KeptCorners contradicted_corners(RefinementOutcome outcome, const PrintedTag& print,
                                               const Quad& corners_px, const StepPlacement& steps);

}  // namespace waymark::refinement

#pragma once

#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

namespace waymark::refinement {

/// Where the steps between cells of different colour place the corners of a tag.
struct StepPlacement {
  Quad shift_px{};      ///< from the given corners to those of the steps; at most about half a cell
  double sigma_px = 0;  ///< standard deviation of a coordinate of a shift, from the scatter of the steps
  double cell_px = 0;   ///< mean side of a cell
  CornerCovariance covariance_px2 = CornerCovariance::Zero();  ///< of shift_px, from the scatter of the steps
  double share = 0;   ///< share of the expected steps that are visible and lie near this placement
  bool bent = false;  ///< the steps lie on curved lines: the tag or the lens bends them
};

/// Measures each step along its normal from the pixels next to it. Unlike the fits of refinement, this does
/// not assume levels that are common to the tag, so shadows, glare and covered parts only lose steps. Only
/// the inside of the border and its sides are used. O(cells), allocates nothing.
[[nodiscard]] StepPlacement place_by_steps(const ImageView& image, const PrintedTag& print,
                                           const Quad& corners_px);

/// Whether enough of the expected steps are visible for the placement to be of use.
[[nodiscard]] bool enough_steps(const StepPlacement& steps);

/// Whether the steps agree on one placement, as far as blur and noise let them.
[[nodiscard]] bool agree(const StepPlacement& steps);

/// Whether the steps contradict corners with this covariance.
[[nodiscard]] bool contradicts(const StepPlacement& steps, const CornerCovariance& covariance_px2);

}  // namespace waymark::refinement

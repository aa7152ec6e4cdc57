#pragma once

#include <array>

#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/pattern_fit.hpp"
#include "waymark/tags/refinement.hpp"
#include "waymark/tags/straightening.hpp"

namespace waymark::refinement {

/// What the fit of one tag works on; some 400 kB, meant for the stack of one call; only what the tag needs of
/// it is touched.
struct TagFit {
  Straightening straightening;
  PatternFit pattern;
  Eigen::LLT<TagMatrix> solver;  ///< of pattern.information
};

/// Puts the pattern of a tag where a detection has it.
void start_fit(const TagDetection& detection, const RefinementOptions& options, const CameraModel* camera,
               TagFit& fit);

/// The corners at the current estimate, in pixels of the image.
[[nodiscard]] Quad corners_of(const TagFit& fit);

/// Smallest side of a cell at any corner [px].
[[nodiscard]] double smallest_cell_px(const Quad& corners, int cells);

/// Reads the pixels where the tag is thought to be, at `corners`. False when too few are in the image.
[[nodiscard]] bool read_tag(const ImageView& image, const Quad& corners, TagFit& fit);

/// What became of a look at the pixels.
struct Look {
  bool usable = false;   ///< enough pixels were left, and the steps were numbers
  bool settled = false;  ///< the last step was small, and the pixels read are those that matter
  double reach_px = 0;   ///< corners that have moved less since the pixels were read need no other look
  double moved_px = 0;   ///< largest displacement of a corner by the last step
};

/// Reads the pixels where the tag is thought to be, at `corners`, and fits it to them: `first` only to find
/// the place, from few pixels.
[[nodiscard]] Look look(const ImageView& image, const RefinementOptions& options, const Quad& corners,
                        bool first, TagFit& fit);

/// How sure the corners are.
struct Certainty {
  Matrix8
      covariance_px2;     ///< of the least squares estimate with the noise and correlation the residuals show
  double excess = 1;      ///< variance by which clusters of pixels pull, over what their noise explains
  double residual = 0;    ///< root mean square, share of the step
  double systematic = 0;  ///< what the residuals of neighbouring pixels have in common, share of the step
};

/// `model_error_px` is added to each corner.
[[nodiscard]] Certainty certainty_of(const TagFit& fit, double model_error_px);

}  // namespace waymark::refinement

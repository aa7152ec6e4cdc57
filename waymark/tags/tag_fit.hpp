#pragma once

#include <optional>

#include "waymark/tags/pattern_fit.hpp"
#include "waymark/tags/refinement.hpp"
#include "waymark/tags/straightening.hpp"

namespace waymark::refinement {

/// What the fit of one tag works on; some hundred kB, meant for the stack of one call.
struct TagFit {
  Pattern pattern;
  Straightening straightening;
  TagPixels pixels;
  TagFitState state;
  TagPriors priors;
  TagMatrix information;  ///< of the pixels, in grey levels
  TagMatrix covariance;   ///< of the last solution, see iterate()
};

/// Puts the pattern of a tag where a detection has it.
void start_fit(const TagDetection& detection, const RefinementOptions& options, const CameraModel* camera,
               TagFit& fit);

/// The corners at the current estimate, in pixels of the image.
[[nodiscard]] Quad corners_of(const TagFit& fit);

/// Smallest side of a cell at any corner [px].
[[nodiscard]] double smallest_cell_px(const Quad& corners, int cells);

/// Reads the pixels where the tag is thought to be, at `corners`. False when too few are in the image.
[[nodiscard]] bool read_tag(const ImageView& image, const RefinementOptions& options, const Quad& corners,
                            TagFit& fit);

/// Black and white, from the pixels and the place that is known about.
void start_levels(TagFit& fit);

/// Gauss-Newton on the pixels as they are; the largest displacement of a corner by the last step [px],
/// nothing when too few pixels are left or the step is no number. `measuring`: to the end, and with patches
/// weighted by how well they fit; otherwise only to find the place.
[[nodiscard]] std::optional<double> iterate(bool measuring, TagFit& fit);

/// Covariance of the corners [px^2], positive definite: of the least squares estimate with the noise and the
/// correlation that the residuals show. `model_error_px` is added to each.
[[nodiscard]] Matrix8 corner_covariance(const TagFit& fit, double model_error_px);

}  // namespace waymark::refinement

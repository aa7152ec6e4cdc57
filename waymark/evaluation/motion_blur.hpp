#pragma once

#include <optional>
#include <vector>

#include "waymark/image/image.hpp"
#include "waymark/samples/robot_samples.hpp"

/// Estimates the exposure time of a camera from the motion blur of tag borders.
namespace waymark {

/// One edge between the black border of a tag and the surrounding white paper, in one image.
struct EdgeBlur {
  double variance_px2 = 0;  ///< of the derivative of the step across the edge, as a density
  double speed_px_s = 0;    ///< velocity of the edge along its normal
};

/// The edges with measurable blur of those tags of `frame` that are also in the frames before and after. Blur
/// is measurable if cells have at least 5 px and the step is unsaturated and at least 30 grey levels. The
/// variance is the second moment of the profile across the edge, which is additive over lens, pixel and
/// motion for any shape. O(edges x length).
[[nodiscard]] std::vector<EdgeBlur> edge_blurs(const ImageView& image, const TagFrame& before,
                                               const TagFrame& frame, const TagFrame& after);

struct BlurFit {
  double exposure_s = 0;
  double still_sigma_px = 0;  ///< of a static edge: lens and pixel
  int edges = 0;
};

/// An edge that moves at v during the exposure t is blurred over v t; a box of that width has the variance (v
/// t)^2 / 12. Fits a straight line through the medians of eight classes of v^2. None with fewer than 200
/// edges, or if the blur of the fastest class exceeds that of the slowest by less than a third of a pixel.
/// O(n log n).
[[nodiscard]] std::optional<BlurFit> fit_exposure(std::vector<EdgeBlur> edges);

}  // namespace waymark

#pragma once

#include <optional>
#include <vector>

#include "waymark/image/image.hpp"
#include "waymark/samples/robot_samples.hpp"

/// Estimates the exposure time of a camera from the motion blur at tag borders.
namespace waymark {

/// One edge between the black border of a tag and the surrounding white paper, in one image.
struct EdgeBlur {
  double variance_px2 = 0;  ///< variance of the derivative of the step across the edge, taken as a density
  double speed_px_s = 0;    ///< velocity of the edge along its normal
};

/// The edges with measurable blur, for those tags in `frame` that also appear in the frames before and after.
/// Blur is measurable if cells are at least 5 px wide and the step is unsaturated and at least 30 grey levels
/// high. The variance is the second moment of the profile across the edge, so the contributions of lens,
/// pixel and motion add up, whatever their shape. O(edges x length).
[[nodiscard]] std::vector<EdgeBlur> edge_blurs(const ImageView& image, const TagFrame& before,
                                               const TagFrame& frame, const TagFrame& after);

struct BlurFit {
  double exposure_s = 0;
  double still_sigma_px = 0;  ///< blur of a static edge due to lens and pixel
  int edges = 0;
};

/// An edge that moves at v during the exposure t is blurred over v t; a box of that width has a variance of
/// (v t)^2 / 12. Fits a straight line through the medians of eight classes of v^2. `nullopt` if there are
/// fewer than 200 edges, or if the blur in the fastest class exceeds that in the slowest by less than a third
/// of a pixel. O(n log n).
[[nodiscard]] std::optional<BlurFit> fit_exposure(std::vector<EdgeBlur> edges);

}  // namespace waymark

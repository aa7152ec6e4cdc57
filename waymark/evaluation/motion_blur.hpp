#pragma once

#include <optional>
#include <vector>

#include "waymark/image/image.hpp"
#include "waymark/samples/robot_samples.hpp"

/// How long a camera exposes, told by how much the borders of tags smear when the picture moves.
namespace waymark {

/// One edge between the black border of a tag and the white paper around it, in one picture.
struct EdgeBlur {
  double variance_px2 = 0;  ///< of the step from black to white across the edge, seen as a density
  double speed_px_s = 0;    ///< of the edge across itself
};

/// The edges of the tags of `frame` that are seen in the frames before and after too, where the smear is
/// told: cells of 5 px or more, a step of 30 grey levels or more that is not saturated. The variance is the
/// second moment of the profile across the edge, which adds up over lens, pixel and motion whatever their
/// shapes. O(edges x length).
[[nodiscard]] std::vector<EdgeBlur> edge_blurs(const ImageView& image, const TagFrame& before,
                                               const TagFrame& frame, const TagFrame& after);

struct BlurFit {
  double exposure_s = 0;
  double still_sigma_px = 0;  ///< of an edge that does not move: lens and pixel
  int edges = 0;
};

/// An edge that moves by v during the exposure t smears over v t, and a box of that width has the variance
/// (v t)^2 / 12: a straight line through the medians of eight classes of v^2. Nothing with fewer than 200
/// edges, or where the fastest classes smear by less than a third of a pixel more than the slowest. O(n log
/// n).
[[nodiscard]] std::optional<BlurFit> fit_exposure(std::vector<EdgeBlur> edges);

}  // namespace waymark

#pragma once

#include <array>
#include <cstddef>

#include "waymark/image/image.hpp"
#include "waymark/tags/refinement/edge_model.hpp"
#include "waymark/tags/refinement/inner_sums.hpp"
#include "waymark/tags/refinement/tag_fit.hpp"

namespace waymark::refinement {

/// Pixels inside the border of a tag and the cells around them.
struct InnerPixels {
  static constexpr int kCorrectionPixels = 200;  ///< enough to correct edges that the border determines
  static constexpr int kPlacementPixels = 800;   ///< enough to determine the edges without the border
  static constexpr int kMaxBlocks = 2 * kPlacementPixels / kLanes;

  std::array<InnerBlock, kMaxBlocks> block;
  int count = 0;  ///< number of pixels
  /// Whether the model includes the effect of the skew on the corners of cells. It is a few thousandths of
  /// the step, which matters only if the step is several times the range of the image.
  bool skew_matters = false;

  [[nodiscard]] std::size_t blocks() const { return static_cast<std::size_t>((count + kLanes - 1) / kLanes); }
};

/// Reads the pixels, with cells placed by the four border edges of `estimate`. In large tags, reads only
/// `most` pixels (kCorrectionPixels or kPlacementPixels), evenly distributed. O(pixels).
void read_inner_pixels(const ImageView& image, const PrintedTag& print, const TagBands& tag,
                       const TagEstimate& estimate, int most, InnerPixels& pixels);

}  // namespace waymark::refinement

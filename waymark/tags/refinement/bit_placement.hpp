#pragma once

#include <optional>

#include "waymark/camera/camera_model.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark::refinement {

/// The corners of a tag from the bits inside its border alone, for tags with an unreliable border: covered,
/// glossy, or with too narrow a white margin. The model is that of inner_bits.hpp with free placement of the
/// pattern (eight parameters, like a homography), starting from the detector's corners. Nothing if too few
/// bits are visible, the family has fewer than four rows of bits inside its border, the fit does not
/// converge, or a corner would move by more than max_shift_px and 0.4 cells. O(pixels), at most some hundred;
/// no allocation.
[[nodiscard]] std::optional<RefinedCorners> place_by_bits(const ImageView& image,
                                                          const TagDetection& detection,
                                                          const RefinementOptions& options,
                                                          const CameraModel* camera);

}  // namespace waymark::refinement

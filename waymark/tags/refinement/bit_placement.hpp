#pragma once

#include <optional>

#include "waymark/camera/camera_model.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark::refinement {

/// Estimates the corners of a tag from the bits inside its border alone, for tags whose border is covered,
/// glossy, or has too narrow a white margin. The model is that of inner_bits.hpp with free placement of the
/// pattern (eight parameters, like a homography), starting from the detector's corners. Returns nothing if
/// too few bits are visible, or the family has fewer than four rows of bits inside its border. The same holds
/// if the fit does not converge, or a corner would move by more than max_shift_px and 0.4 cells. O(pixels),
/// at most some hundred; allocates nothing.
[[nodiscard]] std::optional<RefinedCorners> place_by_bits(const ImageView& image,
                                                          const TagDetection& detection,
                                                          const RefinementOptions& options,
                                                          const CameraModel* camera);

}  // namespace waymark::refinement

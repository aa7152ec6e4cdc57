#pragma once

#include <optional>

#include "waymark/camera/camera_model.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark::refinement {

/// The corners of a tag from the bits inside its border alone, for tags whose border cannot be believed: it
/// is covered, glossy, or its white margin is too narrow. The same model as inner_bits.hpp, with the
/// place of the pattern free (eight numbers, as a homography has), from the detector's corners on. Nothing
/// where too few bits are seen or the family has fewer than four rows of them inside its border, the fit does
/// not settle, or a corner would move by more than max_shift_px and 0.4 cells. O(pixels), at most some
/// hundred; no allocation.
[[nodiscard]] std::optional<RefinedCorners> place_by_bits(const ImageView& image,
                                                          const TagDetection& detection,
                                                          const RefinementOptions& options,
                                                          const CameraModel* camera);

}  // namespace waymark::refinement

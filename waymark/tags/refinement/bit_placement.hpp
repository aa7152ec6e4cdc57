#pragma once

#include <optional>

#include "waymark/camera/camera_model.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

namespace waymark::refinement {

/// Estimates the corners of a tag only from the bits inside its border, for tags whose border is covered or
/// glossy or has too narrow a white margin. The model is that of inner_bits.hpp, but the pattern can be
/// placed freely (eight parameters, like a homography), starting at the detector's corners. Returns `nullopt`
/// if too few bits are visible or the family has fewer than four rows of bits inside its border. The same
/// holds if the fit does not converge, or if a corner would move by more than max_shift_px and 0.4 cells.
/// O(pixels), at most a few hundred; does not allocate.
[[nodiscard]] std::optional<RefinedCorners> place_by_bits(const ImageView& image,
                                                          const TagDetection& detection,
                                                          const PrintedTag& print,
                                                          const RefinementOptions& options,
                                                          const CameraModel* camera);

}  // namespace waymark::refinement

#pragma once

#include <span>

#include "waymark/base/error.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark::plot {

/// The axes of a frame, projected into the image.
struct FrameAxes {
  Eigen::Vector2d origin_px;
  Eigen::Vector2d x_px;  ///< end of the x axis
  Eigen::Vector2d y_px;
  Eigen::Vector2d z_px;
};

/// Draws tags into the image, for display. Each tag gets its quad, with side TL-TR red (the x axis), TL-BL
/// green (the y axis) and the others yellow. TL has a dot and the centre a cross. The upright bounding box is
/// thin and blue, and labelled e.g. "tag36h11:7". Text uses cairo's built-in font, so the result does not
/// depend on installed fonts. Also draws the axes of frames: x red, y green, z blue. Error: LimitExceeded for
/// a side above 32767 px, or if out of memory. O(pixels).
[[nodiscard]] Result<ColorImage> annotate(const ImageView& image, std::span<const TagDetection> detections,
                                          std::span<const FrameAxes> axes = {});

}  // namespace waymark::plot

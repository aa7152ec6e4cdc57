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

/// The image with its tags drawn in, for display. Each tag: its quad, the side TL-TR red (the x axis) and
/// TL-BL green (the y axis), the others yellow; a dot on TL; a cross in the centre; the upright bounding box
/// thin and blue; and "tag36h11:7" beside it. Text uses cairo's built-in font, so the result does not depend
/// on installed fonts. Also draws the axes of frames: x red, y green, z blue. Error: LimitExceeded for a side
/// above 32767 px, or without memory. O(pixels).
[[nodiscard]] Result<ColorImage> annotate(const ImageView& image, std::span<const TagDetection> detections,
                                          std::span<const FrameAxes> axes = {});

}  // namespace waymark::plot

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

/// Draws tags into the image, for display. Each tag is outlined, with side TL-TR in red (the x axis), TL-BL
/// in green (the y axis) and the others in yellow. TL is marked with a dot and the centre with a cross. The
/// upright bounding box is thin and blue and has a label such as "tag36h11:7". Text uses cairo's built-in
/// font, so the result does not depend on installed fonts. Also draws the axes of frames, with x in red, y in
/// green and z in blue. Error: LimitExceeded if a side is longer than 32767 px or memory runs out. O(pixels).
[[nodiscard]] Result<ColorImage> annotate(const ImageView& image, std::span<const TagDetection> detections,
                                          std::span<const FrameAxes> axes = {});

}  // namespace waymark::plot

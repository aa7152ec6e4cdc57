#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "waymark/image/image.hpp"
#include "waymark/tags/quads.hpp"

namespace waymark::search {

/// Homography from cells (the border square is [0, width]^2) to the quad. False where there is none.
[[nodiscard]] bool homography(const Quad& quad, int width, Eigen::Matrix3f& px_H_cell);

/// Levels of an image at places given in cells of a quad.
class CellView {
 public:
  /// `sign`: -1 where the border is bright; levels are then negative, and the border is low again.
  CellView(const ImageView& image, const Eigen::Matrix3f& px_H_cell, float sign)
      : image_(&image), px_H_cell_(px_H_cell), sign_(sign) {}

  /// A pixel with a weight: (x, y, w).
  [[nodiscard]] Eigen::Vector3f place(float u, float v) const {
    return px_H_cell_.col(0) * u + px_H_cell_.col(1) * v + px_H_cell_.col(2);
  }

  /// Bilinear; beyond the image its nearest pixel counts. Times the sign.
  [[nodiscard]] float level(const Eigen::Vector3f& place) const {
    const ImageView& image = *image_;
    const float w = 1 / place.z();
    const float x = std::clamp(place.x() * w - 0.5F, 0.0F, static_cast<float>(image.width - 1));
    const float y = std::clamp(place.y() * w - 0.5F, 0.0F, static_cast<float>(image.height - 1));
    const int x0 = static_cast<int>(x);
    const int y0 = static_cast<int>(y);
    const int right = x0 + 1 < image.width ? 1 : 0;
    const std::uint8_t* top = image.data + static_cast<std::ptrdiff_t>(y0) * image.stride + x0;
    const std::uint8_t* bottom = y0 + 1 < image.height ? top + image.stride : top;
    const float du = x - static_cast<float>(x0);
    const float dv = y - static_cast<float>(y0);
    const float above = static_cast<float>(top[0]) + du * static_cast<float>(top[right] - top[0]);
    const float below = static_cast<float>(bottom[0]) + du * static_cast<float>(bottom[right] - bottom[0]);
    return sign_ * (above + dv * (below - above));
  }

  [[nodiscard]] float level(float u, float v) const { return level(place(u, v)); }
  /// The direction of one cell along u (0) or v (1).
  [[nodiscard]] Eigen::Vector3f step(int axis) const { return px_H_cell_.col(axis); }

 private:
  const ImageView* image_;
  Eigen::Matrix3f px_H_cell_;
  float sign_;
};

}  // namespace waymark::search

#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>

#include "waymark/image/image.hpp"

namespace waymark {

/// Grey level at (x, y) [px], interpolated bilinearly between the four nearest pixel centres (centres at
/// +1/2, so sample_bilinear(image, i + 0.5, j + 0.5) is pixel (i, j) exactly). Border rule: beyond the
/// outermost centres the nearest one counts, so every finite position has a value between 0 and 255. The
/// image must not be empty, x and y must be finite. O(1).
[[nodiscard]] inline double sample_bilinear(const ImageView& image, double x, double y) {
  assert(!image.empty() && std::isfinite(x) && std::isfinite(y));
  const double u = std::clamp(x - 0.5, 0.0, static_cast<double>(image.width - 1));
  const double v = std::clamp(y - 0.5, 0.0, static_cast<double>(image.height - 1));
  const int x0 = static_cast<int>(u);
  const int y0 = static_cast<int>(v);
  const int x1 = std::min(x0 + 1, image.width - 1);
  const std::uint8_t* top = image.row(y0);
  const std::uint8_t* bottom = image.row(std::min(y0 + 1, image.height - 1));
  const double du = u - x0;
  const double dv = v - y0;
  const double above = top[x0] + du * (top[x1] - top[x0]);
  const double below = bottom[x0] + du * (bottom[x1] - bottom[x0]);
  return above + dv * (below - above);
}

/// The part of `image` inside [x, x + width) x [y, y + height), clipped to the image, without copying pixels;
/// an empty view where they do not meet. Pixel (i, j) of the result is pixel (max(x, 0) + i, max(y, 0) + j)
/// of the image.
[[nodiscard]] inline ImageView crop(const ImageView& image, int x, int y, int width, int height) {
  const auto clip = [](std::int64_t value, int limit) {
    return static_cast<int>(std::clamp<std::int64_t>(value, 0, std::max(limit, 0)));
  };
  const int left = clip(x, image.width);
  const int top = clip(y, image.height);
  const int right = clip(std::int64_t{x} + width, image.width);
  const int bottom = clip(std::int64_t{y} + height, image.height);
  if (image.empty() || right <= left || bottom <= top) return {};
  return {image.row(top) + left, right - left, bottom - top, image.stride};
}

}  // namespace waymark

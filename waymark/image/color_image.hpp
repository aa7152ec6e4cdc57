#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/image/image.hpp"

namespace waymark {

/// One colour, sRGB bytes.
struct Rgb {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;

  friend bool operator==(const Rgb&, const Rgb&) = default;
};

/// An owning colour picture, three bytes (r, g, b) a pixel, rows packed. Made for people: nothing measures in
/// it. Pixel (i, j) covers [i, i+1) x [j, j+1), as in Image.
class ColorImage {
 public:
  ColorImage() = default;
  ColorImage(int width, int height, Rgb value = {})
      : width_(width),
        height_(height),
        pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value) {
    assert(width >= 0 && height >= 0);
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] bool empty() const { return pixels_.empty(); }
  [[nodiscard]] Rgb* row(int y) {
    assert(y >= 0 && y < height_);
    return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_;
  }
  [[nodiscard]] const Rgb* row(int y) const {
    assert(y >= 0 && y < height_);
    return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_;
  }
  [[nodiscard]] Rgb at(int x, int y) const {
    assert(x >= 0 && x < width_);
    return row(y)[x];
  }
  /// The first byte of row y: r, g, b, r, g, b, …; 3 * width() bytes.
  [[nodiscard]] const std::uint8_t* row_bytes(int y) const {
    return reinterpret_cast<const std::uint8_t*>(row(y));
  }

  friend bool operator==(const ColorImage&, const ColorImage&) = default;

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<Rgb> pixels_;
};
static_assert(sizeof(Rgb) == 3, "row_bytes() relies on packed pixels");

/// The grey picture as a colour one, to draw on. O(pixels).
[[nodiscard]] inline ColorImage to_color(const ImageView& image) {
  ColorImage color(image.width, image.height);
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* from = image.row(y);
    Rgb* to = color.row(y);
    for (int x = 0; x < image.width; ++x) to[x] = {from[x], from[x], from[x]};
  }
  return color;
}

}  // namespace waymark

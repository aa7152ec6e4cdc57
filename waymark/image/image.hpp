#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace waymark {

/// A grey image whose pixels are owned elsewhere: `height` rows of `width` bytes, with `stride` bytes from
/// one row to the next (stride >= width). Pixel (i, j) covers [i, i+1) x [j, j+1), so its centre is at (i +
/// 1/2, j + 1/2). Copying a view does not copy pixels.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  int stride = 0;  ///< [byte] from one row to the next

  [[nodiscard]] bool empty() const { return data == nullptr || width <= 0 || height <= 0; }
  [[nodiscard]] const std::uint8_t* row(int y) const {
    assert(y >= 0 && y < height);
    return data + static_cast<std::ptrdiff_t>(y) * stride;
  }
  [[nodiscard]] std::uint8_t at(int x, int y) const {
    assert(x >= 0 && x < width);
    return row(y)[x];
  }
};

/// A grey image that owns its pixels, with packed rows (stride == width).
class Image {
 public:
  Image() = default;
  Image(int width, int height, std::uint8_t value = 0)
      : width_(width),
        height_(height),
        pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value) {
    assert(width >= 0 && height >= 0);
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] bool empty() const { return pixels_.empty(); }
  [[nodiscard]] std::uint8_t* row(int y) {
    assert(y >= 0 && y < height_);
    return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_;
  }
  [[nodiscard]] const std::uint8_t* row(int y) const {
    assert(y >= 0 && y < height_);
    return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_;
  }
  [[nodiscard]] ImageView view() const { return {pixels_.data(), width_, height_, width_}; }
  // NOLINTNEXTLINE(google-explicit-constructor): the conversion is free
  operator ImageView() const { return view(); }

  friend bool operator==(const Image&, const Image&) = default;

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<std::uint8_t> pixels_;
};

/// Grey level at (x, y) [px], interpolated bilinearly between the four nearest pixel centres. Centres are at
/// +1/2, so sample_bilinear(image, i + 0.5, j + 0.5) is exactly pixel (i, j). Beyond the outermost centres,
/// the nearest one is used, so the result is between 0 and 255 at every finite position. The image must not
/// be empty, and x and y must be finite. O(1).
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
/// an empty view if they do not overlap. Pixel (i, j) of the result is pixel (max(x, 0) + i, max(y, 0) + j)
/// of `image`.
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

/// A colour as sRGB bytes.
struct Rgb {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;

  friend bool operator==(const Rgb&, const Rgb&) = default;
};

/// A colour image that owns its pixels, with three bytes (r, g, b) per pixel and packed rows. It is only for
/// display; no algorithm performs measurements on it. Pixel (i, j) covers [i, i+1) x [j, j+1), as in Image.
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
  /// Points to the first byte of row y, which holds 3 * width() bytes: r, g, b, r, g, b, …
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

/// The grey image converted to colour, for annotation. O(pixels).
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

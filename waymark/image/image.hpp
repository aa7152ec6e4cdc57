#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace waymark {

/// A grey image somebody else owns: `height` rows of `width` bytes, `stride` bytes from row to row (stride >=
/// width). Pixel (i, j) covers [i, i+1) x [j, j+1); its centre is (i + 1/2, j + 1/2). Copying a view copies
/// no pixels.
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

/// An owning grey image with rows packed (stride == width).
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
  // NOLINTNEXTLINE(google-explicit-constructor): an owner is a view, at no cost
  operator ImageView() const { return view(); }

  friend bool operator==(const Image&, const Image&) = default;

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace waymark

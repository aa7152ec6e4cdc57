#include "waymark/media/yuv420.hpp"

#include <algorithm>
#include <cstring>

namespace waymark::internal {
namespace {

constexpr std::uint8_t kNoColor = 128;

/// 128 and a weighted sum of four pixels, weights in 1e-4.
std::uint8_t chroma(int sum) {
  constexpr int kShare = 4 * 10'000;
  const int rounded = (sum + (sum >= 0 ? kShare / 2 : -kShare / 2)) / kShare;
  return static_cast<std::uint8_t>(std::clamp(128 + rounded, 0, 255));
}

}  // namespace

void fill(const ImageView& image, const Yuv420& to) {
  for (int y = 0; y < to.height; ++y) {
    std::uint8_t* row = to.y + y * to.y_stride;
    const std::uint8_t* from = image.row(std::min(y, image.height - 1));
    const int width = std::min(image.width, to.width);
    std::memcpy(row, from, static_cast<std::size_t>(width));
    std::fill(row + width, row + to.width, from[width - 1]);
  }
  for (int y = 0; y < to.height / 2; ++y) {
    std::fill_n(to.cb + y * to.cb_stride, to.width / 2, kNoColor);
    std::fill_n(to.cr + y * to.cr_stride, to.width / 2, kNoColor);
  }
}

void fill(const ColorImage& image, const Yuv420& to) {
  const auto pixel = [&](int x, int y) {
    return image.row(std::min(y, image.height() - 1))[std::min(x, image.width() - 1)];
  };
  for (int y = 0; y < to.height; ++y) {
    std::uint8_t* row = to.y + y * to.y_stride;
    for (int x = 0; x < to.width; ++x) {
      const Rgb p = pixel(x, y);
      row[x] = static_cast<std::uint8_t>((299 * p.r + 587 * p.g + 114 * p.b + 500) / 1000);
    }
  }
  for (int y = 0; y < to.height / 2; ++y) {
    for (int x = 0; x < to.width / 2; ++x) {
      int r = 0, g = 0, b = 0;
      for (int k = 0; k < 4; ++k) {
        const Rgb p = pixel(2 * x + k % 2, 2 * y + k / 2);
        r += p.r;
        g += p.g;
        b += p.b;
      }
      to.cb[y * to.cb_stride + x] = chroma(-1687 * r - 3313 * g + 5000 * b);
      to.cr[y * to.cr_stride + x] = chroma(5000 * r - 4187 * g - 813 * b);
    }
  }
}

}  // namespace waymark::internal

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/image/image.hpp"

namespace waymark {

/// The image at 1 / factor of its size, each pixel the mean of factor x factor; what does not fill one at the
/// right and below is left out. O(pixels).
[[nodiscard]] inline Image shrunk(const ImageView& image, int factor) {
  Image small(image.width / factor, image.height / factor);
  const int area = factor * factor;
  std::vector<int> sums(static_cast<std::size_t>(small.width()));
  for (int y = 0; y < small.height(); ++y) {
    sums.assign(sums.size(), area / 2);
    for (int k = 0; k < factor; ++k) {
      const std::uint8_t* pixel = image.row(y * factor + k);
      for (int& sum : sums) {
        for (int i = 0; i < factor; ++i) sum += *pixel++;
      }
    }
    for (std::size_t x = 0; x < sums.size(); ++x) small.row(y)[x] = static_cast<std::uint8_t>(sums[x] / area);
  }
  return small;
}

}  // namespace waymark

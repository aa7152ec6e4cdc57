#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/image/image.hpp"
#include "waymark/tags/plane_kernels.hpp"

namespace waymark::search {

/// The least and the greatest level of each tile of 4 x 4 pixels, and of each tile with its eight neighbours.
struct Tiles {
  int columns = 0;
  int rows = 0;
  std::vector<std::uint8_t> low, high;
  std::vector<std::uint8_t> window_low, window_high;
  std::vector<std::uint8_t> scratch;  ///< two rows of tiles, each with one more at both ends
};

/// One bit a pixel, 64 a word, rows begin with a word.
struct BitPlane {
  int width = 0;
  int height = 0;    ///< rows of bits
  int row_step = 1;  ///< [px] rows of the image from one row of bits to the next
  std::size_t words_a_row = 0;
  std::vector<std::uint64_t> words;
  std::vector<std::uint8_t> thresholds;  ///< of one row of tiles

  [[nodiscard]] const std::uint64_t* row(int y) const {
    return words.data() + static_cast<std::size_t>(y) * words_a_row;
  }
};

enum class Polarity : std::uint8_t { Dark, Bright };

/// Fills the tiles of an image. No allocation once they have the size. O(pixels).
void measure_tiles(const ImageView& image, const PlaneKernels& kernels, Tiles& tiles);

/// The range that noise alone gives a tile, from the fifth of the tiles that varies least; times 2.2, but not
/// less than `least`.
[[nodiscard]] int noise_gate(const Tiles& tiles, int least);

/// One bit for each pixel that is darker (brighter) than the threshold of its tile's window, in every row of
/// the image or in each `row_step`th one: 1, 2 or 4.
void threshold(const ImageView& image, const Tiles& tiles, const ThresholdRule& rule,
               const PlaneKernels& kernels, BitPlane& plane, int row_step = 1);

}  // namespace waymark::search

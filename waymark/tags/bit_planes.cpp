#include "waymark/tags/bit_planes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace waymark::search {
namespace {

/// Rows of the image behind one row of tiles; the last one of the image stands for those beyond it.
std::array<const std::uint8_t*, kTilePx> rows_of(const ImageView& image, int tile_row) {
  std::array<const std::uint8_t*, kTilePx> rows{};
  for (int i = 0; i < kTilePx; ++i) {
    rows[static_cast<std::size_t>(i)] = image.row(std::min(tile_row * kTilePx + i, image.height - 1));
  }
  return rows;
}

// Loops the compiler makes vectors of: no kernels of their own.
template <class Better>
void combine(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, int count,
             std::uint8_t* out, Better&& better) {
  for (int i = 0; i < count; ++i) out[i] = better(better(a[i], b[i]), c[i]);
}

/// The best of each tile and its eight neighbours; beyond the border the outermost tile counts.
template <class Better>
void spread_to_neighbours(const std::vector<std::uint8_t>& from, const Tiles& tiles, Better better,
                          std::vector<std::uint8_t>& scratch, std::vector<std::uint8_t>& to) {
  const int n = tiles.columns;
  const auto at = [n](int row) { return static_cast<std::size_t>(row) * static_cast<std::size_t>(n); };
  std::uint8_t* line = scratch.data() + 1;
  for (int y = 0; y < tiles.rows; ++y) {
    const int above = std::max(y - 1, 0);
    const int below = std::min(y + 1, tiles.rows - 1);
    combine(&from[at(above)], &from[at(y)], &from[at(below)], n, line, better);
    line[-1] = line[0];
    line[n] = line[n - 1];
    combine(line - 1, line, line + 1, n, &to[at(y)], better);
  }
}

}  // namespace

void measure_tiles(const ImageView& image, const PlaneKernels& kernels, Tiles& tiles) {
  tiles.columns = (image.width + kTilePx - 1) / kTilePx;
  tiles.rows = (image.height + kTilePx - 1) / kTilePx;
  const auto columns = static_cast<std::size_t>(tiles.columns);
  const std::size_t count = columns * static_cast<std::size_t>(tiles.rows);
  for (auto* of : {&tiles.low, &tiles.high, &tiles.window_low, &tiles.window_high}) of->resize(count);
  tiles.scratch.resize(columns + 2);
  for (int y = 0; y < tiles.rows; ++y) {
    const std::size_t at = static_cast<std::size_t>(y) * columns;
    kernels.tile_extremes(rows_of(image, y), image.width, &tiles.low[at], &tiles.high[at]);
  }
  spread_to_neighbours(
      tiles.low, tiles, [](std::uint8_t a, std::uint8_t b) { return std::min(a, b); }, tiles.scratch,
      tiles.window_low);
  spread_to_neighbours(
      tiles.high, tiles, [](std::uint8_t a, std::uint8_t b) { return std::max(a, b); }, tiles.scratch,
      tiles.window_high);
}

int noise_gate(const Tiles& tiles, int least) {
  constexpr std::size_t kEveryNth = 7;  // no divisor of usual widths: all columns are seen
  constexpr double kTimes = 2.2;
  std::array<int, 256> counts{};
  int total = 0;
  for (std::size_t i = 0; i < tiles.low.size(); i += kEveryNth) {
    ++counts[static_cast<std::size_t>(tiles.high[i] - tiles.low[i])];
    ++total;
  }
  int range = 0;
  for (int below = counts[0]; below <= total / 5 && range < 255; ++range)
    below += counts[static_cast<std::size_t>(range) + 1];
  return std::min(255, std::max(least, static_cast<int>(std::lround(kTimes * range))));
}

void threshold(const ImageView& image, const Tiles& tiles, const ThresholdRule& rule,
               const PlaneKernels& kernels, BitPlane& plane, int row_step) {
  constexpr int kWordBits = 64;
  plane.width = image.width;
  plane.height = (image.height + row_step - 1) / row_step;
  plane.row_step = row_step;
  plane.words_a_row = static_cast<std::size_t>((image.width + kWordBits - 1) / kWordBits);
  plane.words.resize(plane.words_a_row * static_cast<std::size_t>(plane.height));
  plane.thresholds.resize(static_cast<std::size_t>(tiles.columns));
  const auto bits = rule.dark ? kernels.below : kernels.above;
  for (int y = 0; y < image.height; y += row_step) {
    if (y % kTilePx == 0) {
      const std::size_t at = static_cast<std::size_t>(y / kTilePx) * static_cast<std::size_t>(tiles.columns);
      kernels.thresholds(&tiles.window_low[at], &tiles.window_high[at], plane.thresholds.size(), rule,
                         plane.thresholds.data());
    }
    bits(image.row(y), image.width, plane.thresholds.data(),
         plane.words.data() + static_cast<std::size_t>(y / row_step) * plane.words_a_row);
  }
}

}  // namespace waymark::search

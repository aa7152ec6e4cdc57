#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "waymark/image/image.hpp"
#include "waymark/tags/detector/plane_kernels.hpp"

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

[[nodiscard]] inline std::size_t at(std::int32_t index) { return static_cast<std::size_t>(index); }

/// Pixels [x0, x1) of the row y of the image.
struct Run {
  std::int16_t x0 = 0, x1 = 0, y = 0;
  std::int32_t next = -1;       ///< the component's next run, in no order of rows once components were joined
  std::int32_t component = -1;  ///< as it was before joins: follow its parents
};

/// A connected set of pixels: columns [x0, x1), rows [y0, y1). A row of a plane counts for all rows of the
/// image to the plane's next one, in the area and in the number of runs too.
struct Component {
  std::int32_t parent = 0;  ///< itself, or what it was joined to
  std::int16_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  std::int32_t area = 0;
  std::int32_t run_count = 0;
  std::int32_t first = -1, last = -1;  ///< runs
  bool joined_diagonally = false;
};

/// The connected components of a bit plane, from its runs (He, Chao and Suzuki, "A run-based two-scan
/// labeling algorithm", IEEE Transactions on Image Processing 17, 2008). First by shared sides of pixels
/// (4-connected), then, on request, by corners too (8-connected): squares that touch at a corner are apart in
/// the first and thin slanting lines are whole in the second.
class RunComponents {
 public:
  /// O(words + runs). No allocation once the workspace has grown. `diagonals`: whether join_diagonals()
  /// follows.
  void label(const BitPlane& plane, const PlaneKernels& kernels = best_plane_kernels(),
             bool diagonals = true);

  /// Joins what touches at a corner. Components that changed have joined_diagonally set.
  void join_diagonals();

  [[nodiscard]] std::span<const Run> runs() const { return std::span(runs_).first(run_count_); }
  /// [px] See BitPlane.
  [[nodiscard]] int row_step() const { return row_step_; }
  [[nodiscard]] const std::vector<Component>& components() const { return components_; }
  /// Whether components()[index] stands for itself.
  [[nodiscard]] bool is_root(std::int32_t index) const { return components_[at(index)].parent == index; }

 private:
  std::int32_t first_of(std::int32_t run);
  void add_row(int y, std::int32_t above);
  void gather();
  std::int32_t root(std::int32_t component);
  std::int32_t unite(std::int32_t a, std::int32_t b);

  int row_step_ = 1;
  std::size_t run_count_ = 0;
  std::vector<Run> runs_;  ///< beyond run_count_ there is room only
  std::vector<Component> components_;
  std::vector<std::int32_t> set_;  ///< of each run: an earlier run of the same component, or itself
  RowRuns row_;
  std::vector<std::uint64_t> nothing_;                            ///< the row above the first one
  std::vector<std::pair<std::int32_t, std::int32_t>> diagonals_;  ///< runs that touch at a corner
};

}  // namespace waymark::search

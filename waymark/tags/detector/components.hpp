#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "waymark/image/image.hpp"
#include "waymark/tags/detector/plane_kernels.hpp"

namespace waymark::search {

/// Minimum and maximum level in each tile of 4 x 4 pixels, and in each tile together with its eight
/// neighbours.
struct Tiles {
  int columns = 0;
  int rows = 0;
  std::vector<std::uint8_t> low, high;
  std::vector<std::uint8_t> window_low, window_high;
  std::vector<std::uint8_t> scratch;  ///< two rows of tiles, each padded by one tile at both ends
};

/// One bit per pixel, 64 per word; each row begins at a word boundary.
struct BitPlane {
  int width = 0;
  int height = 0;    ///< number of rows of bits
  int row_step = 1;  ///< [px] number of image rows between consecutive rows of bits
  std::size_t words_a_row = 0;
  std::vector<std::uint64_t> words;
  std::vector<std::uint8_t> thresholds;  ///< thresholds for one row of tiles

  [[nodiscard]] const std::uint64_t* row(int y) const {
    return words.data() + static_cast<std::size_t>(y) * words_a_row;
  }
};

enum class Polarity : std::uint8_t { Dark, Bright };

/// Computes the tiles of an image. Does not allocate after the first image of a given size. O(pixels).
void measure_tiles(const ImageView& image, const PlaneKernels& kernels, Tiles& tiles);

/// The range of levels that noise alone produces in a tile: 2.2 times that of the quintile of tiles with the
/// least variation, but at least `least`.
[[nodiscard]] int noise_gate(const Tiles& tiles, int least);

/// Sets one bit for each pixel that is darker (brighter) than the threshold for the window around its tile.
/// Processes every row of the image, or every `row_step`th one, where `row_step` is 1, 2 or 4.
void threshold(const ImageView& image, const Tiles& tiles, const ThresholdRule& rule,
               const PlaneKernels& kernels, BitPlane& plane, int row_step = 1);

[[nodiscard]] inline std::size_t at(std::int32_t index) { return static_cast<std::size_t>(index); }

/// Pixels [x0, x1) in row y of the image.
struct Run {
  std::int16_t x0 = 0, x1 = 0, y = 0;
  std::int32_t next = -1;       ///< the next run in the component; not in row order after joins
  std::int32_t component = -1;  ///< as assigned before joins: follow its parents
};

/// A connected set of pixels: columns [x0, x1), rows [y0, y1). Each row of a plane stands for all image rows
/// up to the next row of the plane; this also applies to the area and the number of runs.
struct Component {
  std::int32_t parent = 0;  ///< the component itself, or the one to which it has been joined
  std::int16_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  std::int32_t area = 0;
  std::int32_t run_count = 0;
  std::int32_t first = -1, last = -1;  ///< indices of runs
  bool joined_diagonally = false;
};

/// The connected components of a bit plane, computed from its runs (He, Chao and Suzuki, "A run-based
/// two-scan labeling algorithm", IEEE Transactions on Image Processing 17, 2008). First labels 4-connected
/// components, and on request also joins diagonal neighbours (8-connected). In the first labelling, squares
/// that touch at a corner are separate; in the second, thin slanting lines are connected.
class RunComponents {
 public:
  /// O(words + runs). Does not allocate once the workspace has grown. `diagonals` specifies whether
  /// join_diagonals() will be called.
  void label(const BitPlane& plane, const PlaneKernels& kernels = best_plane_kernels(),
             bool diagonals = true);

  /// Joins components that touch at a corner, and sets joined_diagonally in those that change.
  void join_diagonals();

  [[nodiscard]] std::span<const Run> runs() const { return std::span(runs_).first(run_count_); }
  /// [px] See BitPlane.
  [[nodiscard]] int row_step() const { return row_step_; }
  [[nodiscard]] const std::vector<Component>& components() const { return components_; }
  /// Whether components()[index] has not been joined to another component.
  [[nodiscard]] bool is_root(std::int32_t index) const { return components_[at(index)].parent == index; }

 private:
  std::int32_t first_of(std::int32_t run);
  void add_row(int y, std::int32_t above);
  void gather();
  std::int32_t root(std::int32_t component);
  std::int32_t unite(std::int32_t a, std::int32_t b);

  int row_step_ = 1;
  std::size_t run_count_ = 0;
  std::vector<Run> runs_;  ///< entries beyond run_count_ are unused
  std::vector<Component> components_;
  std::vector<std::int32_t> set_;  ///< for each run, an earlier run of the same component, or the run itself
  RowRuns row_;
  std::vector<std::uint64_t> nothing_;  ///< zeros, used as the row above the first one
  std::vector<std::pair<std::int32_t, std::int32_t>> diagonals_;  ///< pairs of runs that touch at a corner
};

}  // namespace waymark::search

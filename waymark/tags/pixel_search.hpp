#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "waymark/image/image.hpp"
#include "waymark/tags/pattern.hpp"
#include "waymark/tags/straightening.hpp"

namespace waymark::refinement {

inline constexpr int kMostPixels = 2000;  ///< of one tag

/// Which pixels to read.
struct PixelLimits {
  double outside_cells = 1;  ///< how far outside the border square
  double blur_cells = 0.2;   ///< greatest standard deviation of the blur, tells how many cells matter
  double blur_px = 0.65;
  double cell_px = 4;     ///< smallest side of a cell
  int most_pixels = 800;  ///< of larger tags only so many, evenly spread, most of them near lines of cells
};

/// Where x and y of pixels are counted from, and their unit.
struct PixelFrame {
  Eigen::Vector2d middle_px{0, 0};
  double unit_px = 1;
};

/// A pixel and the cell it lies in.
struct FoundPixel {
  float x, y;
  std::uint8_t value, cell;
};

/// Cells from -1 to `cells` in both directions, by rows.
struct CellGrid {
  static constexpr std::size_t kMost = (kMaxCells + std::size_t{2}) * (kMaxCells + std::size_t{2});
  int side = 0;
  std::array<std::uint16_t, kMost> count;
  std::array<std::uint8_t, kMost> white;   ///< 0 or 1
  std::array<std::uint8_t, kMost> edges;   ///< where another colour begins: 1 left, 2 right, 4 above, 8 below
  std::array<std::uint8_t, kMost> border;  ///< the same, of the border of the tag alone
};

struct FoundPixels {
  CellGrid grid;
  std::array<FoundPixel, kMostPixels> pixel;
  int count = 0;
  std::uint8_t darkest = 255;
  std::uint8_t brightest = 0;
};

/// Finds the pixels around a tag whose homography is known about: x_H_tag takes the border square, from -1 to
/// 1 in both directions, to x and y. False when the tag reaches behind the camera. O(pixels).
[[nodiscard]] bool find_pixels(const ImageView& image, const Pattern& pattern,
                               const Straightening& straightening, const Eigen::Matrix3d& x_H_tag,
                               const PixelLimits& limits, const PixelFrame& frame, FoundPixels& found);

}  // namespace waymark::refinement

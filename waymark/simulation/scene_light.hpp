#pragma once

#include <span>
#include <vector>

#include "waymark/simulation/planar_pattern.hpp"
#include "waymark/simulation/point_spread.hpp"

namespace waymark::photo {

/// What the pixels of a camera gather from flat patterns, row by row.
struct SceneLight {
  int width = 0, height = 0;   ///< [px]
  std::vector<float> covered;  ///< share of the pixel's light that comes from a pattern, 0 to 1
  std::vector<float> level;    ///< sum of share times level (0 ink to 255 paper)

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// Light of patterns, the last one nearest to the camera: it covers those before it. Exact areas on a grid of
/// spread.cells_per_px cells a pixel, gathered with spread.weights. Time goes with the pixels around
/// patterns; memory with some rows of them.
[[nodiscard]] SceneLight gather_light(std::span<const ProjectedPattern> patterns, int width_px, int height_px,
                                      const PointSpread& spread);

}  // namespace waymark::photo

#pragma once

#include <vector>

namespace waymark::photo {

/// How a pixel gathers light: the square of the pixel, spread by a Gaussian lens. As weights for cells of 1/n
/// px, because light is gathered from a grid finer than the pixels (see render_planes).
struct PointSpread {
  int cells_per_px = 1;  ///< n
  int reach_px = 0;      ///< whole pixels beyond the pixel itself that the weights cover, on either side
  std::vector<double> weights;  ///< of the n (1 + 2 reach_px) cells of a row, sum 1, symmetric

  friend bool operator==(const PointSpread&, const PointSpread&) = default;
};

/// The weights for a lens with standard deviation sigma_px; below 0.05 px there is no lens, only the pixel. A
/// weight is the mean over its cell of box * Gaussian; the variance this and the cells add, 1 / (6 n^2), is
/// taken off the Gaussian's.
[[nodiscard]] PointSpread point_spread(double sigma_px);

}  // namespace waymark::photo

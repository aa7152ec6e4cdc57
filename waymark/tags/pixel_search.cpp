#include "waymark/tags/pixel_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/LU>

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

CellGrid cell_grid(const Pattern& pattern) {
  CellGrid grid;
  grid.side = pattern.cells + 2;
  std::size_t id = 0;
  for (int y = -1; y <= pattern.cells; ++y) {
    for (int x = -1; x <= pattern.cells; ++x, ++id) {
      const float own = pattern.white_at(x, y);
      const auto other = [&](int dx, int dy, int bit) {
        return pattern.white_at(x + dx, y + dy) != own ? bit : 0;
      };
      grid.count[id] = 0;
      grid.white[id] = own > 0.5F ? 1 : 0;
      grid.edges[id] =
          static_cast<std::uint8_t>(other(-1, 0, 1) + other(1, 0, 2) + other(0, -1, 4) + other(0, 1, 8));
      const int n = pattern.cells;
      grid.border[id] = static_cast<std::uint8_t>(
          (x == 0 ? 1 : 0) + (x == -1 ? 2 : 0) + (x == n - 1 ? 2 : 0) + (x == n ? 1 : 0) + (y == 0 ? 4 : 0) +
          (y == -1 ? 8 : 0) + (y == n - 1 ? 8 : 0) + (y == n ? 4 : 0));
    }
  }
  return grid;
}

/// The square that reaches `far` border squares from the middle in the image.
bool outline(const Eigen::Matrix3d& x_H_tag, double far, const PixelFrame& frame,
             std::array<Vector2d, 4>& corners) {
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector3d p = x_H_tag * Vector3d(k == 1 || k == 2 ? far : -far, k >= 2 ? far : -far, 1);
    if (p.z() <= 0.05) return false;
    corners[k] = frame.middle_px + frame.unit_px * p.head<2>() / p.z();
  }
  return true;
}

double area(const std::array<Vector2d, 4>& corners) {
  double twice = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d& a = corners[k];
    const Vector2d& b = corners[(k + 1) % 4];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

/// Where a row of pixels crosses a convex outline, as pixel indices: from `first` up to, not including,
/// `last`.
struct Span {
  int first = 0;
  int last = 0;
};

Span crossing(const std::array<Vector2d, 4>& corners, double y, int width) {
  double low = std::numeric_limits<double>::max();
  double high = std::numeric_limits<double>::lowest();
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d& a = corners[k];
    const Vector2d& b = corners[(k + 1) % 4];
    if ((a.y() > y) == (b.y() > y)) continue;
    const double x = a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    low = std::min(low, x);
    high = std::max(high, x);
  }
  if (low > high) return {};
  return {std::max(0, static_cast<int>(std::ceil(low - 0.5))),
          std::min(width, static_cast<int>(std::floor(high - 0.5)) + 1)};
}

/// Every `stride`-th pixel of a row, where the rows are shifted against each other so that those taken spread
/// evenly. Of large tags all of them near the border, which tells most about the corners; half of them near
/// where else black turns to white; a quarter elsewhere.
struct Sampling {
  bool all = false;  ///< every pixel
  int stride = 1;
  int skew = 0;
  float flat_from = 1;  ///< [cell] distance from such a line beyond which a pixel is far
};

Sampling sampling_of(double area_px, int cells, const PixelLimits& limits) {
  constexpr double kNearBlurs = 2.5;
  Sampling sampling;
  const double near = std::min(0.5, std::max(2.0, kNearBlurs * limits.blur_px) / limits.cell_px);
  const double side = cells + 2 * limits.outside_cells;
  const double border = std::min(1.0, 8 * cells * near / (side * side));  // shares of the area
  const double edges = (1 - border) * (1 - (1 - near) * (1 - near));      // half of the lines are such ones
  const double taken = border + 0.5 * edges + 0.25 * (1 - border - edges);
  sampling.flat_from = static_cast<float>(near);
  sampling.all = area_px < 1.3 * limits.most_pixels;
  sampling.stride =
      sampling.all ? 1 : std::max(1, static_cast<int>(std::lround(area_px * taken / limits.most_pixels)));
  // Without a common divisor: else some columns would never be read, and an edge along them is seen at few
  // distances only.
  sampling.skew = std::max(1, static_cast<int>(std::lround(0.382 * sampling.stride)));
  while (std::gcd(sampling.skew, sampling.stride) > 1) --sampling.skew;
  return sampling;
}

/// Pixels to cells.
struct CellMap {
  std::array<float, 9> H;
  float low, high;  ///< [cell] limits
};

/// Some pixels of a row, `stride` apart: in x and y and in cells.
struct RowChunk {
  static constexpr int kPixels = 16;
  std::array<float, kPixels> x, y, u, v;
};

void map_chunk(const Straightening& straightening, const CellMap& map, const PixelFrame& frame, int px,
               int stride, const Straightening::Row& bent, double y_px, RowChunk& chunk) {
  const auto inverse_unit = static_cast<float>(1 / frame.unit_px);
  const auto x0 = static_cast<float>(px + 0.5 - frame.middle_px.x());
  const auto y0 = static_cast<float>(y_px - frame.middle_px.y()) * inverse_unit;
  for (std::size_t i = 0; i < RowChunk::kPixels; ++i) {
    chunk.x[i] = (x0 + static_cast<float>(static_cast<int>(i) * stride)) * inverse_unit;
    chunk.y[i] = y0;
  }
  if (straightening.moves()) {
    for (std::size_t i = 0; i < RowChunk::kPixels; ++i) {
      const Vector2d shift = bent.at(straightening.along(px + static_cast<int>(i) * stride + 0.5));
      chunk.x[i] += static_cast<float>(shift.x()) * inverse_unit;
      chunk.y[i] += static_cast<float>(shift.y()) * inverse_unit;
    }
  }
  const auto& H = map.H;
  for (std::size_t i = 0; i < RowChunk::kPixels; ++i) {
    const float x = chunk.x[i];
    const float y = chunk.y[i];
    const float w = 1.0F / (H[6] * x + H[7] * y + H[8]);
    chunk.u[i] = (H[0] * x + H[1] * y + H[2]) * w;
    chunk.v[i] = (H[3] * x + H[4] * y + H[5]) * w;
  }
}

/// Whether a pixel at (u, v) of cell `id` is one to read; `turn` counts those that could be.
bool worth_reading(const CellGrid& grid, std::size_t id, float from_u, float from_v, float near, int turn) {
  const int close = (from_u < near ? 1 : 0) + (from_u > 1 - near ? 2 : 0) + (from_v < near ? 4 : 0) +
                    (from_v > 1 - near ? 8 : 0);
  return (close & grid.border[id]) != 0 || ((close & grid.edges[id]) != 0 && (turn & 1) == 0) ||
         (turn & 3) == 0;
}

void find_row(const ImageView& image, const Straightening& straightening, const CellMap& map,
              const Sampling& sampling, const PixelFrame& frame, const Span& span, int py,
              FoundPixels& found) {
  const Straightening::Row bent = straightening.row(py + 0.5);
  const int stride = sampling.stride;
  // Counted from the middle of the tag, so that a tag is read the same wherever it lies.
  const int from_middle = py - static_cast<int>(frame.middle_px.y());
  const int phase = static_cast<int>(frame.middle_px.x()) + (sampling.skew * from_middle) % stride;
  const std::uint8_t* row = image.row(py);
  const int side = found.grid.side;
  int px = span.first + (((phase - span.first) % stride) + stride) % stride;
  RowChunk chunk;
  for (int turn = (px - phase) / stride + from_middle; px < span.last; px += RowChunk::kPixels * stride) {
    map_chunk(straightening, map, frame, px, stride, bent, py + 0.5, chunk);
    const int count = std::min(RowChunk::kPixels, (span.last - px + stride - 1) / stride);
    for (int i = 0; i < count; ++i, ++turn) {
      const auto at = static_cast<std::size_t>(i);
      const float u = chunk.u[at];
      const float v = chunk.v[at];
      const bool within = u > map.low && v > map.low && u < map.high && v < map.high;
      if (!within) continue;
      const int column = static_cast<int>(u + 1);  // u + 1 > 0
      const int line = static_cast<int>(v + 1);
      if ((column == 0 || column == side - 1) && (line == 0 || line == side - 1)) continue;
      const int cell = line * side + column;
      const auto id = static_cast<std::size_t>(cell);
      const float from_u = u + 1 - static_cast<float>(column);
      const float from_v = v + 1 - static_cast<float>(line);
      if (!sampling.all && !worth_reading(found.grid, id, from_u, from_v, sampling.flat_from, turn)) continue;
      if (found.count == kMostPixels) return;
      const std::uint8_t value = row[px + i * stride];
      found.darkest = std::min(found.darkest, value);
      found.brightest = std::max(found.brightest, value);
      ++found.grid.count[id];
      found.pixel[static_cast<std::size_t>(found.count++)] = {chunk.x[at], chunk.y[at], value,
                                                              static_cast<std::uint8_t>(id)};
    }
  }
}

}  // namespace

bool find_pixels(const ImageView& image, const Pattern& pattern, const Straightening& straightening,
                 const Eigen::Matrix3d& x_H_tag, const PixelLimits& limits, const PixelFrame& frame,
                 FoundPixels& found) {
  const int n = pattern.cells;
  std::array<Vector2d, 4> corners;
  // The lens moves pixels by less than this.
  const double spare = straightening.moves() ? 2 / frame.unit_px : 0;
  if (!outline(x_H_tag, 1 + 2 * limits.outside_cells / n + spare, frame, corners)) return false;
  found.grid = cell_grid(pattern);
  const Sampling sampling = sampling_of(area(corners), n, limits);
  Eigen::Matrix3d tag_H_x = x_H_tag.inverse();
  CellMap map{};
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    map.H[at] = static_cast<float>(0.5 * n * (tag_H_x(0, i) + tag_H_x(2, i)));
    map.H[3 + at] = static_cast<float>(0.5 * n * (tag_H_x(1, i) + tag_H_x(2, i)));
    map.H[6 + at] = static_cast<float>(tag_H_x(2, i));
  }
  map.low = static_cast<float>(-limits.outside_cells);
  map.high = static_cast<float>(n + limits.outside_cells);
  const auto [lowest, highest] =
      std::ranges::minmax({corners[0].y(), corners[1].y(), corners[2].y(), corners[3].y()});
  const int first = std::max(0, static_cast<int>(std::ceil(lowest - 0.5)));
  const int last = std::min(image.height - 1, static_cast<int>(std::floor(highest - 0.5)));
  for (int py = first; py <= last; ++py) {
    find_row(image, straightening, map, sampling, frame, crossing(corners, py + 0.5, image.width), py, found);
  }
  return true;
}

}  // namespace waymark::refinement

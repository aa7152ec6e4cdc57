#include "waymark/simulation/scene_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "waymark/simulation/coverage.hpp"

namespace waymark::photo {
namespace {

/// Whole pixels [x_begin, x_end) x [y_begin, y_end).
struct Window {
  int x_begin = 0, y_begin = 0, x_end = 0, y_end = 0;

  [[nodiscard]] bool empty() const { return x_begin >= x_end || y_begin >= y_end; }
  [[nodiscard]] int width() const { return x_end - x_begin; }
  [[nodiscard]] int height() const { return y_end - y_begin; }
};

Window overlap(const Window& a, const Window& b) {
  return {std::max(a.x_begin, b.x_begin), std::max(a.y_begin, b.y_begin), std::min(a.x_end, b.x_end),
          std::min(a.y_end, b.y_end)};
}

/// The pixels a pattern touches; coordinates are below 1e6 by construction.
Window window_of(const ProjectedPattern& pattern) {
  if (pattern.pieces.empty()) return {};
  return {static_cast<int>(std::floor(pattern.min_px.x())), static_cast<int>(std::floor(pattern.min_px.y())),
          static_cast<int>(std::ceil(pattern.max_px.x())), static_cast<int>(std::ceil(pattern.max_px.y()))};
}

/// Covered share and level of a cell.
using Light = std::array<float, 2>;

/// Rows of light.
class LightRows {
 public:
  LightRows(int width, int height)
      : width_(static_cast<std::size_t>(width)), cells_(width_ * static_cast<std::size_t>(height)) {}
  [[nodiscard]] Light* row(int y) { return cells_.data() + static_cast<std::size_t>(y) * width_; }
  [[nodiscard]] const Light* row(int y) const { return cells_.data() + static_cast<std::size_t>(y) * width_; }
  [[nodiscard]] std::size_t width() const { return width_; }

 private:
  std::size_t width_;
  std::vector<Light> cells_;
};

/// A band of pixel rows, gathered from a finer grid that reaches over its sides as far as the lens spreads.
class Band {
 public:
  Band(const Window& pixels, const PointSpread& spread)
      : pixels_(pixels),
        spread_(spread),
        n_(spread.cells_per_px),
        grid_({pixels.x_begin - spread.reach_px, pixels.y_begin - spread.reach_px,
               pixels.x_end + spread.reach_px, pixels.y_end + spread.reach_px}),
        cells_(grid_.width() * n_, grid_.height() * n_) {}

  /// Lays a pattern over what is there.
  void add(const ProjectedPattern& pattern, Coverage& coverage) {
    const Window part = overlap(grid_, window_of(pattern));
    if (part.empty()) return;
    coverage.reset(part.width() * n_, part.height() * n_);
    const Eigen::Vector2d origin(part.x_begin, part.y_begin);
    std::vector<Eigen::Vector2d> corners;
    for (const ProjectedPattern::Piece& piece : pattern.pieces) {
      if (piece.y_max <= part.y_begin || piece.y_min >= part.y_end) continue;
      corners.clear();
      for (std::size_t i = piece.begin; i < piece.end; ++i) {
        corners.emplace_back((pattern.corners_px[i] - origin) * n_);
      }
      coverage.add(corners, piece.level);
    }
    for (int y = 0; y < coverage.height(); ++y) lay_row(part, y, coverage.finish_row(y));
  }

  /// Gathers the light of the band's pixels: along rows first, then down columns.
  void gather(SceneLight& light) const {
    const LightRows rows = gather_rows();
    const std::size_t width = rows.width();
    for (int y = pixels_.y_begin; y < pixels_.y_end; ++y) {
      const Light* from = rows.row((y - pixels_.y_begin) * n_);
      for (std::size_t x = 0; x < width; ++x) {
        double covered = 0;
        double level = 0;
        for (std::size_t k = 0; k < spread_.weights.size(); ++k) {
          const Light& cell = from[k * width + x];
          covered += spread_.weights[k] * static_cast<double>(cell[0]);
          level += spread_.weights[k] * static_cast<double>(cell[1]);
        }
        const std::size_t to = light.index(pixels_.x_begin + static_cast<int>(x), y);
        light.covered[to] = static_cast<float>(std::clamp(covered, 0.0, 1.0));
        light.level[to] = static_cast<float>(std::clamp(level, 0.0, 255.0));
      }
    }
  }

 private:
  /// Nearer paper hides what lies behind it, cell by cell.
  void lay_row(const Window& part, int y, std::span<const Coverage::Cell> row) {
    Light* to = cells_.row((part.y_begin - grid_.y_begin) * n_ + y) + (part.x_begin - grid_.x_begin) * n_;
    for (const Coverage::Cell& cell : row) {
      const auto open = static_cast<float>(1 - cell.covered);
      (*to)[0] = (*to)[0] * open + static_cast<float>(cell.covered);
      (*to)[1] = (*to)[1] * open + static_cast<float>(cell.value);
      ++to;
    }
  }

  [[nodiscard]] LightRows gather_rows() const {
    LightRows rows(pixels_.width(), grid_.height() * n_);
    for (int y = 0; y < grid_.height() * n_; ++y) {
      const Light* from = cells_.row(y);
      Light* to = rows.row(y);
      for (int x = 0; x < pixels_.width(); ++x, from += n_) {
        double covered = 0;
        double level = 0;
        for (std::size_t k = 0; k < spread_.weights.size(); ++k) {
          covered += spread_.weights[k] * static_cast<double>(from[k][0]);
          level += spread_.weights[k] * static_cast<double>(from[k][1]);
        }
        *to++ = {static_cast<float>(covered), static_cast<float>(level)};
      }
    }
    return rows;
  }

  Window pixels_;
  const PointSpread& spread_;
  int n_;
  Window grid_;
  LightRows cells_;
};

}  // namespace

SceneLight gather_light(std::span<const ProjectedPattern> patterns, int width_px, int height_px,
                        const PointSpread& spread) {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  SceneLight light{width_px, height_px, std::vector<float>(pixels), std::vector<float>(pixels)};
  const int reach = spread.reach_px;
  const int band_height = std::max(16, 2 * reach);
  Coverage coverage;
  for (int y = 0; y < height_px; y += band_height) {
    const Window strip{0, y, width_px, std::min(y + band_height, height_px)};
    Window active{width_px, strip.y_begin, 0, strip.y_end};  // columns with something in them
    for (const ProjectedPattern& pattern : patterns) {
      const Window touched = window_of(pattern);
      const Window spread_out{touched.x_begin - reach, touched.y_begin - reach, touched.x_end + reach,
                              touched.y_end + reach};
      const Window part = overlap(strip, spread_out);
      if (part.empty()) continue;
      active.x_begin = std::min(active.x_begin, part.x_begin);
      active.x_end = std::max(active.x_end, part.x_end);
    }
    if (active.empty()) continue;
    Band band(active, spread);
    for (const ProjectedPattern& pattern : patterns) band.add(pattern, coverage);
    band.gather(light);
  }
  return light;
}

}  // namespace waymark::photo

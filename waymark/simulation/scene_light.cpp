#include "waymark/simulation/scene_light.hpp"

#include <algorithm>
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

/// Rows of cells, two numbers each: covered share and level, interleaved.
class LightRows {
 public:
  LightRows(int cells, int rows)
      : stride_(2 * static_cast<std::size_t>(cells)), values_(stride_ * static_cast<std::size_t>(rows)) {}
  [[nodiscard]] std::span<float> row(int y) {
    return {values_.data() + static_cast<std::size_t>(y) * stride_, stride_};
  }
  [[nodiscard]] std::span<const float> row(int y) const {
    return {values_.data() + static_cast<std::size_t>(y) * stride_, stride_};
  }

 private:
  std::size_t stride_;
  std::vector<float> values_;
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

  /// Gathers the light of the band's pixels: down columns first, then along rows.
  void gather(SceneLight& light) const {
    const LightRows columns = gather_columns();
    for (int y = 0; y < pixels_.height(); ++y) {
      const float* from = columns.row(y).data();
      for (int x = 0; x < pixels_.width(); ++x, from += 2 * n_) {
        double covered = 0;
        double level = 0;
        const float* cell = from;
        for (const double weight : spread_.weights) {
          covered += weight * static_cast<double>(*cell++);
          level += weight * static_cast<double>(*cell++);
        }
        const std::size_t to = light.index(pixels_.x_begin + x, pixels_.y_begin + y);
        light.covered[to] = static_cast<float>(std::clamp(covered, 0.0, 1.0));
        light.level[to] = static_cast<float>(std::clamp(level, 0.0, 255.0));
      }
    }
  }

 private:
  /// Nearer paper hides what lies behind it, cell by cell.
  void lay_row(const Window& part, int y, std::span<const Coverage::Cell> row) {
    const std::span<float> cells = cells_.row((part.y_begin - grid_.y_begin) * n_ + y);
    float* to = cells.data() + 2 * n_ * (part.x_begin - grid_.x_begin);
    for (const Coverage::Cell& cell : row) {
      const auto open = static_cast<float>(1 - cell.covered);
      *to = *to * open + static_cast<float>(cell.covered);
      ++to;
      *to = *to * open + static_cast<float>(cell.value);
      ++to;
    }
  }

  /// One row a pixel row, still of fine cells. Nearly all the time goes here: so the inner loop runs along
  /// memory.
  [[nodiscard]] LightRows gather_columns() const {
    LightRows columns(grid_.width() * n_, pixels_.height());
    for (int y = 0; y < pixels_.height(); ++y) {
      const std::span<float> to = columns.row(y);
      for (std::size_t k = 0; k < spread_.weights.size(); ++k) {
        const auto weight = static_cast<float>(spread_.weights[k]);
        const float* from = cells_.row(y * n_ + static_cast<int>(k)).data();
        for (float& sum : to) sum += weight * *from++;
      }
    }
    return columns;
  }

  Window pixels_;
  const PointSpread& spread_;
  int n_;
  Window grid_;
  LightRows cells_;
};

/// The columns of a strip that patterns light, as runs with nothing in between: no time is spent on the gaps.
std::vector<Window> lit_parts(std::span<const ProjectedPattern> patterns, const Window& strip, int reach) {
  std::vector<Window> parts;
  for (const ProjectedPattern& pattern : patterns) {
    const Window touched = window_of(pattern);
    if (touched.empty()) continue;
    Window part = overlap(strip, {touched.x_begin - reach, touched.y_begin - reach, touched.x_end + reach,
                                  touched.y_end + reach});
    if (part.empty()) continue;
    part.y_begin = strip.y_begin;
    part.y_end = strip.y_end;
    parts.push_back(part);
  }
  std::sort(parts.begin(), parts.end(),
            [](const Window& a, const Window& b) { return a.x_begin < b.x_begin; });
  std::vector<Window> runs;
  for (const Window& part : parts) {
    if (runs.empty() || part.x_begin > runs.back().x_end) {
      runs.push_back(part);
    } else {
      runs.back().x_end = std::max(runs.back().x_end, part.x_end);
    }
  }
  return runs;
}

}  // namespace

SceneLight gather_light(std::span<const ProjectedPattern> patterns, int width_px, int height_px,
                        const PointSpread& spread) {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  SceneLight light{width_px, height_px, std::vector<float>(pixels), std::vector<float>(pixels)};
  const int strip_height = std::max(16, 2 * spread.reach_px);
  Coverage coverage;
  for (int y = 0; y < height_px; y += strip_height) {
    const Window strip{0, y, width_px, std::min(y + strip_height, height_px)};
    for (const Window& part : lit_parts(patterns, strip, spread.reach_px)) {
      Band band(part, spread);
      for (const ProjectedPattern& pattern : patterns) band.add(pattern, coverage);
      band.gather(light);
    }
  }
  return light;
}

}  // namespace waymark::photo

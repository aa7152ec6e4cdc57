#include "waymark/tags/pattern_pixels.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kFewestPixels = 60;

PatchWindow window_around(const Pattern& pattern, int column, int row, int steps, bool& known) {
  PatchWindow window;
  window.steps = steps;
  const int reach = steps / 2;  // cells before the patch
  const int x0 = column - reach;
  const int y0 = row - reach;
  window.first_u = static_cast<float>(x0 + 1);
  window.first_v = static_cast<float>(y0 + 1);
  known = true;
  for (int r = 0; r <= steps; ++r) {
    for (int c = 0; c <= steps; ++c) {
      const int x = std::clamp(x0 + c, -Pattern::kRing, pattern.cells + Pattern::kRing - 1);
      const int y = std::clamp(y0 + r, -Pattern::kRing, pattern.cells + Pattern::kRing - 1);
      window.share[r][c] = pattern.white_at(x, y);
      known = known && pattern.known_at(x, y);
    }
  }
  return window;
}

int side_of(const Pattern& pattern, double u, double v) {
  const bool left = u < 0;
  const bool right = u > pattern.cells;
  const bool top = v < 0;
  const bool bottom = v > pattern.cells;
  if ((left || right) && (top || bottom)) return -2;
  if (top) return 0;
  if (right) return 1;
  if (bottom) return 2;
  return left ? 3 : -1;
}

/// The side beyond whose margin a cell sees what lies there: that outside which it is, or, where the blur is
/// `wide`, next to which; -1 where there is none or two.
int rim_side(int cells, int x, int y, bool wide) {
  if (y < 0) return 0;
  if (x == cells) return 1;
  if (y == cells) return 2;
  if (x < 0) return 3;
  const bool across = y == 0 || y == cells - 1;
  const bool along = x == 0 || x == cells - 1;
  if (!wide || across == along) return -1;
  if (across) return y == 0 ? 0 : 2;
  return x == 0 ? 3 : 1;
}

void set_rim(const Pattern& pattern, int side, PatchWindow& window) {
  window.rim_along_u = side == 1 || side == 3;
  window.rim_sign = side == 0 || side == 3 ? -1.0F : 1.0F;
  window.rim_at = window.rim_sign < 0 ? static_cast<float>(-pattern.ring)
                                      : static_cast<float>(pattern.cells + pattern.ring);
}

}  // namespace

Pattern tag_pattern(const TagId& id) {
  const Family& table = family(id.family);
  const std::uint64_t code = table.codes[static_cast<std::size_t>(id.number)];
  Pattern pattern;
  pattern.cells = table.width_at_border;
  pattern.ring = (table.total_width - table.width_at_border) / 2;
  for (auto& row : pattern.white) row.fill(1.0F);
  for (auto& row : pattern.known) row.fill(true);
  const auto set = [&](int x, int y, float white, bool known) {
    pattern.white[Pattern::index(y)][Pattern::index(x)] = white;
    pattern.known[Pattern::index(y)][Pattern::index(x)] = known;
  };
  const int n = pattern.cells;
  const float inner = table.reversed_border ? 1.0F : 0.0F;
  for (int y = -1; y <= n; ++y) {
    for (int x = -1; x <= n; ++x) {
      const bool outside = x < 0 || y < 0 || x == n || y == n;
      const bool border = !outside && (x == 0 || y == 0 || x == n - 1 || y == n - 1);
      set(x, y, outside ? 1.0F - inner : inner, outside || border);
    }
  }
  for (std::size_t bit = 0; bit < table.bits.size(); ++bit) {
    const bool white = ((code >> (table.bits.size() - 1 - bit)) & 1U) != 0;
    set(table.bits[bit].x, table.bits[bit].y, white ? 1.0F : 0.0F, true);
  }
  return pattern;
}

PatchRows TagPixels::rows(const Patch& of) const {
  const std::size_t first = static_cast<std::size_t>(of.first_row) * kLanes;
  return {of.rows, clipped, &x[first], &y[first], &value[first], &weight[first]};
}

bool read_pixels(const ImageView& image, const Pattern& pattern, const Eigen::Matrix3d& x_H_tag,
                 const PixelLimits& limits, TagPixels& pixels) {
  const int n = pattern.cells;
  const double out = limits.outside_cells;
  Eigen::Matrix3d tag_H_x = x_H_tag.inverse();
  tag_H_x /= tag_H_x(2, 2);
  Eigen::Array2d low(1e9, 1e9);
  Eigen::Array2d high(-1e9, -1e9);
  double area_px = 0;
  {
    const double far = 1 + 2 * out / n;
    std::array<Vector2d, 4> c;
    for (std::size_t k = 0; k < 4; ++k) {
      const Vector3d p = x_H_tag * Vector3d(k == 1 || k == 2 ? far : -far, k >= 2 ? far : -far, 1);
      if (p.z() <= 0.05) return false;
      c[k] = pixels.middle_px + pixels.unit_px * p.head<2>() / p.z();
      low = low.min(c[k].array());
      high = high.max(c[k].array());
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const Vector2d& a = c[k];
      const Vector2d& b = c[(k + 1) % 4];
      area_px += 0.5 * (a.x() * b.y() - a.y() * b.x());
    }
  }
  const int side = n + 2;  // patches along the tag
  const int steps = limits.blur_cells < 0.22 ? 2 : 4;
  const int stride = std::max(1, static_cast<int>(std::ceil(area_px / limits.most_pixels)));
  const int skew = std::max(1, static_cast<int>(std::lround(0.382 * stride)));
  const int x0 = std::max(0, static_cast<int>(std::floor(low.x())));
  const int x1 = std::min(image.width, static_cast<int>(std::ceil(high.x())));
  const int y0 = std::max(0, static_cast<int>(std::floor(low.y())));
  const int y1 = std::min(image.height, static_cast<int>(std::ceil(high.y())));

  std::array<int, TagPixels::kMostPatches> count{};
  constexpr int kMost = TagPixels::kMostRows * kLanes;
  struct Found {
    float x, y;
    std::uint8_t value, patch;
  };
  std::array<Found, kMost / 2> found;
  std::size_t total = 0;
  std::uint8_t darkest = 255;
  std::uint8_t brightest = 0;
  for (int py = y0; py < y1; ++py) {
    const Straightening::Row bent = limits.straightening.row(py + 0.5);
    const int shift = (skew * py) % stride;
    int px = x0 + (((-(x0 + shift)) % stride) + stride) % stride;
    for (; px < x1; px += stride) {
      Vector2d place = Vector2d(px + 0.5, py + 0.5) - pixels.middle_px;
      if (limits.straightening.moves()) place += bent.at(limits.straightening.along(px + 0.5));
      const double x = place.x() / pixels.unit_px;
      const double y = place.y() / pixels.unit_px;
      const double w = tag_H_x(2, 0) * x + tag_H_x(2, 1) * y + 1;
      if (w < 0.05) continue;
      const double u = 0.5 * n * ((tag_H_x(0, 0) * x + tag_H_x(0, 1) * y + tag_H_x(0, 2)) / w + 1);
      const double v = 0.5 * n * ((tag_H_x(1, 0) * x + tag_H_x(1, 1) * y + tag_H_x(1, 2)) / w + 1);
      if (u < -out || v < -out || u > n + out || v > n + out) continue;
      if (side_of(pattern, u, v) == -2 || total == found.size()) continue;
      const int column = static_cast<int>(std::floor(u)) + 1;
      const int row = static_cast<int>(std::floor(v)) + 1;
      const auto id = static_cast<std::size_t>(row * side + column);
      const std::uint8_t value = image.row(py)[px];
      darkest = std::min(darkest, value);
      brightest = std::max(brightest, value);
      found[total++] = {static_cast<float>(x), static_cast<float>(y), value, static_cast<std::uint8_t>(id)};
      ++count[id];
    }
  }
  pixels.clipped =
      darkest <= static_cast<std::uint8_t>(kDarkest) || brightest >= static_cast<std::uint8_t>(kBrightest);
  pixels.patches = 0;
  pixels.pixels = 0;
  std::array<int, TagPixels::kMostPatches> next{};
  next.fill(-1);
  int rows = 0;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const auto id = static_cast<std::size_t>(row * side + column);
      if (count[id] == 0) continue;
      bool known = false;
      const PatchWindow window = window_around(pattern, column - 1, row - 1, steps, known);
      const int needed = (count[id] + kLanes - 1) / kLanes;
      if (!known || rows + needed > TagPixels::kMostRows) continue;
      Patch& patch = pixels.patch[static_cast<std::size_t>(pixels.patches++)];
      patch = {};
      patch.window = window;
      patch.first_row = rows;
      patch.rows = needed;
      patch.side = rim_side(n, column - 1, row - 1, limits.blur_cells > 0.25);
      if (patch.side >= 0) set_rim(pattern, patch.side, patch.window);
      next[id] = rows * kLanes;
      for (int i = rows * kLanes; i < (rows + needed) * kLanes; ++i) {
        const auto at = static_cast<std::size_t>(i);
        pixels.x[at] = pixels.y[at] = pixels.value[at] = pixels.weight[at] = 0;
      }
      rows += needed;
    }
  }
  for (std::size_t i = 0; i < total; ++i) {
    const Found& f = found[i];
    if (next[f.patch] < 0) continue;
    const auto at = static_cast<std::size_t>(next[f.patch]++);
    pixels.x[at] = f.x;
    pixels.y[at] = f.y;
    pixels.value[at] = f.value;
    pixels.weight[at] = 1;
    ++pixels.pixels;
  }
  for (int p = 0; p < pixels.patches; ++p) {
    Patch& patch = pixels.patch[static_cast<std::size_t>(p)];
    double sum = 0;
    for (int i = patch.first_row * kLanes; i < (patch.first_row + patch.rows) * kLanes; ++i) {
      const auto at = static_cast<std::size_t>(i);
      patch.x += static_cast<double>(pixels.weight[at] * pixels.x[at]);
      patch.y += static_cast<double>(pixels.weight[at] * pixels.y[at]);
      sum += static_cast<double>(pixels.weight[at]);
    }
    patch.x /= sum;
    patch.y /= sum;
    // Places without a pixel lie where the others do.
    for (int i = patch.first_row * kLanes; i < (patch.first_row + patch.rows) * kLanes; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (pixels.weight[at] > 0) continue;
      pixels.x[at] = static_cast<float>(patch.x);
      pixels.y[at] = static_cast<float>(patch.y);
    }
  }
  return pixels.pixels >= kFewestPixels;
}

}  // namespace waymark::refinement

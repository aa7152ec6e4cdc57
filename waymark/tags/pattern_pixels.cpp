#include "waymark/tags/pattern_pixels.hpp"

#include <algorithm>
#include <cstddef>

namespace waymark::refinement {
namespace {

constexpr int kFewestPixels = 50;
constexpr int kGroups = 5;  ///< of clusters: inside, and next to each side's margin

/// What the cells around one are like, see PatternRows::share; false where one of them is not known.
bool shares_around(const Pattern& pattern, int column, int row, std::size_t steps,
                   std::array<float, shares_of(kMostSteps)>& shares) {
  std::array<std::array<float, kMostSteps + 1>, kMostSteps + 1> white{};
  const int reach = static_cast<int>(steps / 2);
  bool known = true;
  for (std::size_t r = 0; r <= steps; ++r) {
    for (std::size_t c = 0; c <= steps; ++c) {
      const int x = column - reach + static_cast<int>(c);
      const int y = row - reach + static_cast<int>(r);
      white[r][c] = pattern.white_at(x, y);
      known = known && pattern.known_at(x, y);
    }
  }
  std::size_t at = 0;
  shares[at++] = white[0][0];
  for (std::size_t a = 0; a < steps; ++a) shares[at++] = white[0][a + 1] - white[0][a];
  for (std::size_t b = 0; b < steps; ++b) shares[at++] = white[b + 1][0] - white[b][0];
  for (std::size_t b = 0; b < steps; ++b) {
    for (std::size_t a = 0; a < steps; ++a)
      shares[at++] = white[b + 1][a + 1] - white[b + 1][a] - white[b][a + 1] + white[b][a];
  }
  return known;
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

/// Where the pixel at a place in the order of clusters is kept.
struct Slot {
  std::size_t block, at;
};

Slot slot_of(int place) {
  const int cluster = place / kClusterPixels;
  return {static_cast<std::size_t>(cluster / kLanes),
          static_cast<std::size_t>(place % kClusterPixels * kLanes + cluster % kLanes)};
}

void set_side(const Pattern& pattern, int side, int cluster, TagPixels& pixels) {
  PixelBlock& block = pixels.block[static_cast<std::size_t>(cluster / kLanes)];
  const int lane = cluster % kLanes;
  const auto inner = static_cast<float>(pattern.ring);
  const auto outer = static_cast<float>(pattern.cells + pattern.ring);
  block.side[lane] = side;
  block.rim_u[lane] = side == 1 ? 1.0F : side == 3 ? -1.0F : 0.0F;
  block.rim_v[lane] = side == 2 ? 1.0F : side == 0 ? -1.0F : 0.0F;
  block.rim_1[lane] = side < 0 ? 0.0F : side == 1 || side == 2 ? -outer : -inner;
  block.rim_level[lane] = 0;
  block.cluster_weight[lane] = 1;
  block.rim_matters = (lane > 0 && block.rim_matters) || side >= 0;
}

void clear_slots(int from, int to, std::size_t shares, TagPixels& pixels) {
  for (int place = from; place < to; ++place) {
    const Slot slot = slot_of(place);
    PixelBlock& block = pixels.block[slot.block];
    block.x[slot.at] = block.y[slot.at] = block.value[slot.at] = block.weight[slot.at] = 0;
    block.first_u[slot.at] = block.first_v[slot.at] = 0;
    for (std::size_t i = 0; i < shares; ++i) block.share[i][slot.at] = 0;
  }
}

/// What all pixels of a cell have in common, and the place of the next of them.
struct Cell {
  int next;  ///< -1: its surroundings are not known
  float first_u, first_v;
  std::array<float, shares_of(kMostSteps)> shares;
};

using Cells = std::array<Cell, CellGrid::kMost>;

/// Gives every cell its places: those of one group one after the other, groups from a new cluster on.
void place_cells(const Pattern& pattern, const CellGrid& grid, bool wide, TagPixels& pixels, Cells& cells) {
  const std::size_t shares = shares_of(pixels.steps);
  const int reach = static_cast<int>(pixels.steps / 2);
  int place = 0;
  for (int group = 0; group < kGroups; ++group) {
    const int first = place;
    for (int row = -1; row <= pattern.cells; ++row) {
      for (int column = -1; column <= pattern.cells; ++column) {
        const int place_in_grid = (row + 1) * grid.side + column + 1;
        const auto id = static_cast<std::size_t>(place_in_grid);
        if (grid.count[id] == 0 || rim_side(pattern.cells, column, row, wide) != group - 1) continue;
        Cell& cell = cells[id];
        cell.next = -1;
        if (!shares_around(pattern, column, row, pixels.steps, cell.shares)) continue;
        cell.next = place;
        cell.first_u = static_cast<float>(column + 1 - reach);
        cell.first_v = static_cast<float>(row + 1 - reach);
        place += grid.count[id];
      }
    }
    pixels.pixels += place - first;
    const int end = (place + kClusterPixels - 1) / kClusterPixels * kClusterPixels;
    clear_slots(place, end, shares, pixels);
    for (int cluster = first / kClusterPixels; cluster < end / kClusterPixels; ++cluster)
      set_side(pattern, group - 1, cluster, pixels);
    place = end;
  }
  pixels.blocks = (place + kBlockPixels - 1) / kBlockPixels;
  clear_slots(place, pixels.blocks * kBlockPixels, shares, pixels);
  for (int cluster = place / kClusterPixels; cluster < pixels.blocks * kLanes; ++cluster)
    set_side(pattern, -1, cluster, pixels);
}

void put(const FoundPixel& found, Cell& cell, std::size_t shares, TagPixels& pixels) {
  if (cell.next < 0) return;
  const Slot slot = slot_of(cell.next++);
  PixelBlock& block = pixels.block[slot.block];
  block.x[slot.at] = found.x;
  block.y[slot.at] = found.y;
  block.value[slot.at] = found.value;
  block.weight[slot.at] = 1;
  block.first_u[slot.at] = cell.first_u;
  block.first_v[slot.at] = cell.first_v;
  for (std::size_t i = 0; i < shares; ++i) block.share[i][slot.at] = cell.shares[i];
}

}  // namespace

bool read_pixels(const ImageView& image, const Pattern& pattern, const Straightening& straightening,
                 const Eigen::Matrix3d& x_H_tag, const PixelLimits& limits, TagPixels& pixels) {
  constexpr double kFewLinesMatter = 0.3;  // the third line is then 3.3 blurs away
  constexpr double kWide = 0.25;
  FoundPixels found;
  if (!find_pixels(image, pattern, straightening, x_H_tag, limits, {pixels.middle_px, pixels.unit_px}, found))
    return false;
  pixels.steps = limits.blur_cells < kFewLinesMatter ? 2 : kMostSteps;
  pixels.pixels = 0;
  pixels.clipped = found.darkest <= static_cast<std::uint8_t>(kDarkest) ||
                   found.brightest >= static_cast<std::uint8_t>(kBrightest);
  Cells cells;
  place_cells(pattern, found.grid, limits.blur_cells > kWide, pixels, cells);
  const std::size_t shares = shares_of(pixels.steps);
  std::array<int, 2> count{};
  std::array<int, 2> sum{};
  for (int i = 0; i < found.count; ++i) {
    const FoundPixel& pixel = found.pixel[static_cast<std::size_t>(i)];
    put(pixel, cells[pixel.cell], shares, pixels);
    const std::size_t colour = found.grid.white[pixel.cell];
    ++count[colour];
    sum[colour] += pixel.value;
  }
  pixels.black = static_cast<double>(sum[0]) / std::max(1, count[0]);
  pixels.white = static_cast<double>(sum[1]) / std::max(1, count[1]);
  return pixels.pixels >= kFewestPixels;
}

}  // namespace waymark::refinement

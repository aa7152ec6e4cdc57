#include "waymark/tags/detector/components.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace waymark::search {
namespace {

/// The rows of the image in one row of tiles; rows beyond the image repeat the last one.
std::array<const std::uint8_t*, kTilePx> rows_of(const ImageView& image, int tile_row) {
  std::array<const std::uint8_t*, kTilePx> rows{};
  for (int i = 0; i < kTilePx; ++i) {
    rows[static_cast<std::size_t>(i)] = image.row(std::min(tile_row * kTilePx + i, image.height - 1));
  }
  return rows;
}

// The compiler vectorises these loops, so they do not need hand-written kernels.
template <class Better>
void combine(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, int count,
             std::uint8_t* out, Better&& better) {
  for (int i = 0; i < count; ++i) out[i] = better(better(a[i], b[i]), c[i]);
}

/// The best value in each tile and its eight neighbours; beyond the image border, the outermost tile is used.
template <class Better>
void spread_to_neighbours(const std::vector<std::uint8_t>& from, const Tiles& tiles, Better better,
                          std::vector<std::uint8_t>& scratch, std::vector<std::uint8_t>& to) {
  const int n = tiles.columns;
  const auto at = [n](int row) { return static_cast<std::size_t>(row) * static_cast<std::size_t>(n); };
  std::uint8_t* line = scratch.data() + 1;
  for (int y = 0; y < tiles.rows; ++y) {
    const int above = std::max(y - 1, 0);
    const int below = std::min(y + 1, tiles.rows - 1);
    combine(&from[at(above)], &from[at(y)], &from[at(below)], n, line, better);
    line[-1] = line[0];
    line[n] = line[n - 1];
    combine(line - 1, line, line + 1, n, &to[at(y)], better);
  }
}

}  // namespace

void measure_tiles(const ImageView& image, const PlaneKernels& kernels, Tiles& tiles) {
  tiles.columns = (image.width + kTilePx - 1) / kTilePx;
  tiles.rows = (image.height + kTilePx - 1) / kTilePx;
  const auto columns = static_cast<std::size_t>(tiles.columns);
  const std::size_t count = columns * static_cast<std::size_t>(tiles.rows);
  for (auto* of : {&tiles.low, &tiles.high, &tiles.window_low, &tiles.window_high}) of->resize(count);
  tiles.scratch.resize(columns + 2);
  for (int y = 0; y < tiles.rows; ++y) {
    const std::size_t at = static_cast<std::size_t>(y) * columns;
    kernels.tile_extremes(rows_of(image, y), image.width, &tiles.low[at], &tiles.high[at]);
  }
  spread_to_neighbours(
      tiles.low, tiles, [](std::uint8_t a, std::uint8_t b) { return std::min(a, b); }, tiles.scratch,
      tiles.window_low);
  spread_to_neighbours(
      tiles.high, tiles, [](std::uint8_t a, std::uint8_t b) { return std::max(a, b); }, tiles.scratch,
      tiles.window_high);
}

int noise_gate(const Tiles& tiles, int least) {
  constexpr std::size_t kEveryNth = 7;  // does not divide common widths, so all columns are sampled
  constexpr double kTimes = 2.2;
  std::array<int, 256> counts{};
  int total = 0;
  for (std::size_t i = 0; i < tiles.low.size(); i += kEveryNth) {
    ++counts[static_cast<std::size_t>(tiles.high[i] - tiles.low[i])];
    ++total;
  }
  int range = 0;
  for (int below = counts[0]; below <= total / 5 && range < 255; ++range)
    below += counts[static_cast<std::size_t>(range) + 1];
  return std::min(255, std::max(least, static_cast<int>(std::lround(kTimes * range))));
}

void threshold(const ImageView& image, const Tiles& tiles, const ThresholdRule& rule,
               const PlaneKernels& kernels, BitPlane& plane, int row_step) {
  constexpr int kWordBits = 64;
  plane.width = image.width;
  plane.height = (image.height + row_step - 1) / row_step;
  plane.row_step = row_step;
  plane.words_a_row = static_cast<std::size_t>((image.width + kWordBits - 1) / kWordBits);
  plane.words.resize(plane.words_a_row * static_cast<std::size_t>(plane.height));
  plane.thresholds.resize(static_cast<std::size_t>(tiles.columns));
  const auto bits = rule.dark ? kernels.below : kernels.above;
  for (int y = 0; y < image.height; y += row_step) {
    if (y % kTilePx == 0) {
      const std::size_t at = static_cast<std::size_t>(y / kTilePx) * static_cast<std::size_t>(tiles.columns);
      kernels.thresholds(&tiles.window_low[at], &tiles.window_high[at], plane.thresholds.size(), rule,
                         plane.thresholds.data());
    }
    bits(image.row(y), image.width, plane.thresholds.data(),
         plane.words.data() + static_cast<std::size_t>(y / row_step) * plane.words_a_row);
  }
}

std::int32_t RunComponents::root(std::int32_t component) {
  while (components_[at(component)].parent != component) {
    std::int32_t& parent = components_[at(component)].parent;
    parent = components_[at(parent)].parent;
    component = parent;
  }
  return component;
}

std::int32_t RunComponents::unite(std::int32_t a, std::int32_t b) {
  if (a > b) std::swap(a, b);
  Component& into = components_[at(a)];
  Component& from = components_[at(b)];
  from.parent = a;
  into.x0 = std::min(into.x0, from.x0);
  into.x1 = std::max(into.x1, from.x1);
  into.y0 = std::min(into.y0, from.y0);
  into.y1 = std::max(into.y1, from.y1);
  into.area += from.area;
  into.run_count += from.run_count;
  runs_[at(into.last)].next = from.first;
  into.last = from.last;
  return a;
}

/// The first run in the set that contains this run. While rows are being added, sets are identified by their
/// first run.
std::int32_t RunComponents::first_of(std::int32_t run) {
  while (set_[at(run)] != run) {
    set_[at(run)] = set_[at(set_[at(run)])];
    run = set_[at(run)];
  }
  return run;
}

void RunComponents::add_row(int y, std::int32_t above) {
  const auto here = static_cast<std::int32_t>(run_count_);
  const std::size_t count = row_.count;
  run_count_ += count;
  if (run_count_ > runs_.size()) {
    runs_.resize(2 * run_count_);
    set_.resize(runs_.size());
  }
  Run* const run = runs_.data() + here;
  std::int32_t* const set = set_.data() + here;
  for (std::size_t k = 0; k < count; ++k) {
    run[k] = {row_.begins[k], row_.ends[k], static_cast<std::int16_t>(y), -1, -1};
    set[k] = here + static_cast<std::int32_t>(k);
  }
  for (std::size_t k = 0; k < row_.side_count; ++k) {
    const std::int32_t id = here + row_.sides[k].here;
    const std::int32_t theirs = first_of(above + row_.sides[k].above);
    if (set_[at(id)] == id) {
      set_[at(id)] = theirs;
      continue;
    }
    const std::int32_t mine = first_of(id);
    set_[at(std::max(mine, theirs))] = std::min(mine, theirs);
  }
  for (std::size_t k = 0; k < row_.corner_count; ++k)
    diagonals_.emplace_back(above + row_.corners[k].above, here + row_.corners[k].here);
}

/// Builds the components from the sets. The first run of a set precedes all its other runs.
void RunComponents::gather() {
  const auto count = static_cast<std::int32_t>(run_count_);
  for (std::int32_t id = 0; id < count; ++id) {
    Run& run = runs_[at(id)];
    const auto next_row = static_cast<std::int16_t>(run.y + row_step_);
    if (set_[at(id)] == id) {
      run.component = static_cast<std::int32_t>(components_.size());
      components_.push_back({run.component, run.x0, run.x1, run.y, next_row, (run.x1 - run.x0) * row_step_,
                             row_step_, id, id, false});
      continue;
    }
    run.component = runs_[at(set_[at(id)])].component;
    Component& component = components_[at(run.component)];
    component.x0 = std::min(component.x0, run.x0);
    component.x1 = std::max(component.x1, run.x1);
    component.y1 = next_row;
    component.area += (run.x1 - run.x0) * row_step_;
    component.run_count += row_step_;
    runs_[at(component.last)].next = id;
    component.last = id;
  }
}

void RunComponents::label(const BitPlane& plane, const PlaneKernels& kernels, bool diagonals) {
  run_count_ = 0;
  components_.clear();
  diagonals_.clear();
  row_step_ = plane.row_step;
  row_.begin_plane(plane.width, diagonals);
  nothing_.assign(plane.words_a_row, 0);
  std::int32_t above = 0;
  for (int y = 0; y < plane.height; ++y) {
    kernels.runs_of_row(plane.row(y), y == 0 ? nothing_.data() : plane.row(y - 1), plane.words_a_row, row_);
    const auto here = static_cast<std::int32_t>(run_count_);
    add_row(y * row_step_, above);
    above = here;
  }
  gather();
}

void RunComponents::join_diagonals() {
  for (const auto& [a, b] : diagonals_) {
    const std::int32_t one = root(runs_[at(a)].component);
    const std::int32_t two = root(runs_[at(b)].component);
    if (one != two) components_[at(unite(one, two))].joined_diagonally = true;
  }
}

}  // namespace waymark::search

#include "waymark/plot/tag_outline.hpp"

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>

namespace waymark::plot {
namespace {

enum Direction : unsigned { kRight, kDown, kLeft, kUp };
constexpr unsigned kDirections = 4;
constexpr std::array<int, kDirections> kStepX = {1, 0, -1, 0};
constexpr std::array<int, kDirections> kStepY = {0, 1, 0, -1};

Cells blank(int width, bool ink = false) {
  Cells cells{width, {}};
  cells.ink.assign(cells.index(0, width), ink);
  return cells;
}

/// The edges between ink and white, each directed so that the ink is on its right.
class Sides {
 public:
  explicit Sides(const Cells& cells) : cells_(cells), lattice_(cells.width + 1) {
    starts_.fill(blank(lattice_));
    for (int y = 0; y < cells.width; ++y) {
      for (int x = 0; x < cells.width; ++x) {
        if (!ink(x, y)) continue;
        if (!ink(x, y - 1)) side(x, y, kRight) = true;
        if (!ink(x + 1, y)) side(x + 1, y, kDown) = true;
        if (!ink(x, y + 1)) side(x + 1, y + 1, kLeft) = true;
        if (!ink(x - 1, y)) side(x, y + 1, kUp) = true;
      }
    }
  }

  [[nodiscard]] int lattice() const { return lattice_; }

  [[nodiscard]] bool there(const BitCell& at, unsigned direction) { return side(at.x, at.y, direction); }

  /// Removes the edge that starts at a lattice point in this direction; returns false if there is none.
  bool take(const BitCell& at, unsigned direction) {
    const bool was_there = there(at, direction);
    side(at.x, at.y, direction) = false;
    return was_there;
  }

 private:
  [[nodiscard]] bool ink(int x, int y) const {
    if (x < 0 || y < 0 || x >= cells_.width || y >= cells_.width) return false;
    return cells_.at(x, y);
  }
  std::vector<bool>::reference side(int x, int y, unsigned direction) {
    Cells& starts = starts_.at(direction);
    return starts.ink[starts.index(x, y)];
  }

  const Cells& cells_;
  int lattice_;
  std::array<Cells, kDirections> starts_;  ///< for each direction, the lattice points at which an edge starts
};

/// Follows the loop that starts to the right of a lattice point, and removes its edges. At a point where two
/// inked cells touch at a corner, it turns right and stays with the same cell.
std::vector<BitCell> walk(Sides& sides, const BitCell start) {
  std::vector<BitCell> corners;
  BitCell at = start;
  unsigned direction = kRight;
  do {
    at.x += kStepX.at(direction);
    at.y += kStepY.at(direction);
    for (const unsigned turn : {1U, 0U, 3U}) {
      const unsigned next = (direction + turn) % kDirections;
      if (!sides.take(at, next)) continue;
      if (turn != 0) corners.push_back(at);
      direction = next;
      break;
    }
  } while (at.x != start.x || at.y != start.y || direction != kRight);
  return corners;
}

}  // namespace

Cells tag_cells(const TagId& tag) {
  const std::vector<std::uint8_t> bytes = bitmap(tag);
  assert(!bytes.empty());
  Cells cells{family(tag.family).total_width, std::vector<bool>(bytes.size())};
  for (std::size_t i = 0; i < bytes.size(); ++i) cells.ink[i] = bytes[i] == 0;
  return cells;
}

Cells two_cell_border(const TagId& tag) {
  const Cells plain = tag_cells(tag);
  const int border = family(tag.family).width_at_border;
  assert(!family(tag.family).reversed_border);
  const int margin = (plain.width - border) / 2;
  Cells cells = blank(border + 2, true);
  for (int y = 1; y < border - 1; ++y) {
    for (int x = 1; x < border - 1; ++x) {
      cells.ink[cells.index(x + 1, y + 1)] = plain.at(x + margin, y + margin);
    }
  }
  return cells;
}

std::vector<std::vector<Point>> outline(const Cells& cells, const Box& place) {
  Sides sides(cells);
  std::vector<std::vector<Point>> loops;
  for (int y = 0; y < sides.lattice(); ++y) {
    for (int x = 0; x < sides.lattice(); ++x) {
      if (!sides.there({x, y}, kRight)) continue;
      std::vector<Point>& loop = loops.emplace_back();
      for (const BitCell& corner : walk(sides, {x, y})) {
        loop.push_back({place.x_mm + place.width_mm * corner.x / cells.width,
                        place.y_mm + place.height_mm * corner.y / cells.width});
      }
    }
  }
  return loops;
}

}  // namespace waymark::plot

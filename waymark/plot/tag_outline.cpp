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

/// The sides between ink and white, each walked with the ink on its right hand.
class Sides {
 public:
  explicit Sides(const Cells& cells) : cells_(cells), lattice_(cells.width + 1) {
    for (auto& starts : starts_) starts.assign(static_cast<std::size_t>(lattice_ * lattice_), false);
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

  /// Takes away the side that starts at a lattice point; false when there is none in this direction.
  bool take(const BitCell& at, unsigned direction) {
    const bool was_there = there(at, direction);
    side(at.x, at.y, direction) = false;
    return was_there;
  }

 private:
  [[nodiscard]] bool ink(int x, int y) const {
    if (x < 0 || y < 0 || x >= cells_.width || y >= cells_.width) return false;
    return cells_.ink[static_cast<std::size_t>(y * cells_.width + x)];
  }
  std::vector<bool>::reference side(int x, int y, unsigned direction) {
    return starts_.at(direction)[static_cast<std::size_t>(y * lattice_ + x)];
  }

  const Cells& cells_;
  int lattice_;
  std::array<std::vector<bool>, kDirections> starts_;
};

/// Walks the loop that starts to the right of a lattice point, and takes its sides away. Where two inked
/// cells touch at a corner, it turns right and stays with its cell.
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
  const int width = border + 2;
  Cells cells{width, std::vector<bool>(static_cast<std::size_t>(width * width), true)};
  for (int y = 1; y < border - 1; ++y) {
    for (int x = 1; x < border - 1; ++x) {
      cells.ink[static_cast<std::size_t>((y + 1) * width + x + 1)] =
          plain.ink[static_cast<std::size_t>((y + margin) * plain.width + x + margin)];
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

#include "waymark/tags/surroundings.hpp"

#include <cassert>
#include <cstddef>
#include <utility>

namespace waymark::refinement {
namespace {

/// Which place of which row beside edge `k` the cell (x, y) is: rows count from the edge inwards, the ring
/// inside the border is row 0, the bits behind it row 1; outwards the ring is row -1, what lies beyond it row
/// -2.
std::pair<int, int> row_and_place(int k, int cells, const BitCell& cell) {
  switch (k) {
    case 0:
      return {cell.y, cell.x};
    case 1:
      return {cells - 1 - cell.x, cell.y};
    case 2:
      return {cells - 1 - cell.y, cells - 1 - cell.x};
    default:
      return {cell.x, cells - 1 - cell.y};
  }
}

}  // namespace

std::array<Surroundings, 4> tag_surroundings(const TagId& id) {
  const Family& table = family(id.family);
  const int cells = table.width_at_border;
  assert(cells <= kMaxCells && id.number >= 0 && static_cast<std::size_t>(id.number) < table.codes.size());
  const std::uint64_t code = table.codes[static_cast<std::size_t>(id.number)];
  std::array<Surroundings, 4> edges;
  std::array<int, 4> known_beyond{};
  for (Surroundings& edge : edges) edge.cells = cells;
  for (std::size_t bit = 0; bit < table.bits.size(); ++bit) {
    const bool white = ((code >> (table.bits.size() - 1 - bit)) & 1U) != 0;
    const float share = white != table.reversed_border ? 1.0F : 0.0F;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto [row, place] = row_and_place(static_cast<int>(k), cells, table.bits[bit]);
      if (place < 0 || place >= cells) continue;
      if (row == 1) edges[k].behind[static_cast<std::size_t>(place)] = share;
      if (row == -2) {
        edges[k].beyond[static_cast<std::size_t>(place)] = share;
        ++known_beyond[k];
      }
    }
  }
  for (std::size_t k = 0; k < 4; ++k) edges[k].beyond_known = known_beyond[k] == cells;
  return edges;
}

}  // namespace waymark::refinement

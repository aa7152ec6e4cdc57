#include "waymark/tags/pattern.hpp"

#include <cstdint>

namespace waymark::refinement {

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

}  // namespace waymark::refinement

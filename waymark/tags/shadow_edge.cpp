#include "waymark/tags/shadow_edge.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace waymark::search {
namespace {

constexpr std::size_t kMostCells = 80;  // around a border of 19 cells
constexpr std::size_t kLeastArc = 3;    // cells

/// The cells around the border, clockwise.
struct Ring {
  std::array<Eigen::Vector2i, kMostCells> cell;
  std::array<float, kMostCells + 1> sum{}, squares{};  ///< of the levels before a cell
  std::size_t count = 0;

  explicit Ring(const CellLevels& cells) {
    const int w = cells.width;
    for (int k = -1; k < w; ++k) add(cells, k, -1);
    for (int k = -1; k < w; ++k) add(cells, w, k);
    for (int k = w; k > -1; --k) add(cells, k, w);
    for (int k = w; k > -1; --k) add(cells, -1, k);
  }

  void add(const CellLevels& cells, int x, int y) {
    const float level = cells.at(x, y);
    cell[count] = {x, y};
    sum[count + 1] = sum[count] + level;
    squares[count + 1] = squares[count] + level * level;
    ++count;
  }
  /// Between the middles of a cell and of the one before.
  [[nodiscard]] Eigen::Vector2f before(std::size_t i) const {
    const Eigen::Vector2i both = cell[i] + cell[(i + count - 1) % count];
    return 0.5F * both.cast<float>() + Eigen::Vector2f(0.5F, 0.5F);
  }
};

/// The cells from `begin` to before `end`, and all others.
struct Arcs {
  std::size_t begin = 0, end = 0;
  float error = 0;  ///< sum of squares about the means of both
};

std::optional<Arcs> best_arcs(const Ring& ring) {
  const std::size_t n = ring.count;
  const float all = ring.sum[n];
  const float squares = ring.squares[n];
  std::optional<Arcs> best;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + kLeastArc; j < n && n - (j - i) >= kLeastArc; ++j) {
      const auto inside = static_cast<float>(j - i);
      const float sum = ring.sum[j] - ring.sum[i];
      const float rest = all - sum;
      const float error = squares - sum * sum / inside - rest * rest / (static_cast<float>(n) - inside);
      if (!best || error < best->error) best = Arcs{i, j, error};
    }
  }
  return best;
}

/// Mean level of the cells of an arc but those at its ends, which are partly in the shadow.
float mean_of(const Ring& ring, std::size_t begin, std::size_t count) {
  float sum = 0;
  for (std::size_t k = 1; k + 1 < count; ++k) {
    const std::size_t i = (begin + k) % ring.count;
    sum += ring.sum[i + 1] - ring.sum[i];
  }
  return sum / static_cast<float>(count - 2);
}

/// Mean level of the border's cells on both sides of the edge; false where there are none.
bool border_levels(const CellLevels& cells, ShadowEdge& edge) {
  std::array<float, 2> count{};
  const int last = cells.width - 1;
  for (int y = 0; y <= last; ++y) {
    for (int x = 0; x <= last; ++x) {
      if (x != 0 && y != 0 && x != last && y != last) continue;
      const float lit = edge.lit(x, y);
      if (lit > 0 && lit < 1) continue;
      const std::size_t side = lit > 0 ? 1 : 0;
      edge.border.at(side) += cells.at(x, y);
      count.at(side) += 1;
    }
  }
  if (count[0] == 0 || count[1] == 0) return false;
  edge.border = {edge.border[0] / count[0], edge.border[1] / count[1]};
  return true;
}

}  // namespace

float ShadowEdge::lit(int x, int y) const {
  const Eigen::Vector2f middle(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
  return std::clamp(normal.dot(middle) - offset + 0.5F, 0.0F, 1.0F);
}

float ShadowEdge::in_the_light(float level, int x, int y) const {
  const float light = lit(x, y);
  const float black = border[0] + light * (border[1] - border[0]);
  const float white = around[0] + light * (around[1] - around[0]);
  return border[1] + (level - black) * (around[1] - border[1]) / (white - black);
}

std::optional<ShadowEdge> find_shadow_edge(const CellLevels& cells, float min_contrast) {
  constexpr float kExplained = 0.4F;  // what is left of the sum of squares, at most
  constexpr float kLeastLength = 2;   // cells between the ends of the edge
  const int around = 4 * (cells.width + 1);
  if (cells.width < 2 || static_cast<std::size_t>(around) > kMostCells) return std::nullopt;
  const Ring ring(cells);
  const std::optional<Arcs> arcs = best_arcs(ring);
  const auto n = static_cast<float>(ring.count);
  const float whole = ring.squares[ring.count] - ring.sum[ring.count] * ring.sum[ring.count] / n;
  if (!arcs || !(arcs->error < kExplained * whole)) return std::nullopt;
  const Eigen::Vector2f from = ring.before(arcs->begin);
  const Eigen::Vector2f to = ring.before(arcs->end % ring.count);
  if ((to - from).norm() < kLeastLength) return std::nullopt;
  const std::size_t inside = arcs->end - arcs->begin;
  const float arc = mean_of(ring, arcs->begin, inside);
  const float rest = mean_of(ring, arcs->end, ring.count - inside);
  ShadowEdge edge;
  // The arc lies to the left of the way from its begin to its end, for the ring runs clockwise as seen.
  const Eigen::Vector2f along = (to - from).normalized();
  edge.normal = Eigen::Vector2f(along.y(), -along.x()) * (arc > rest ? 1.0F : -1.0F);
  edge.offset = edge.normal.dot(from);
  edge.around = {std::min(arc, rest), std::max(arc, rest)};
  if (!border_levels(cells, edge)) return std::nullopt;
  for (const std::size_t side : {0U, 1U})
    if (!(edge.around.at(side) - edge.border.at(side) >= min_contrast)) return std::nullopt;
  return edge;
}

}  // namespace waymark::search

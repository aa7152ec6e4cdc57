#include "waymark/simulation/pixel_area.hpp"

#include <array>
#include <cassert>
#include <cstddef>

namespace waymark::render {
namespace {

constexpr float kHorizon = 1e-6F;
constexpr std::size_t kMostColumns = PatternGrid::kMostCells + 6;

/// A corner of a piece of the pixel: where in the pixel, and on the plane.
struct Vertex {
  float x = 0, y = 0;
  float a = 0, b = 0, c = 0;
};

/// A convex piece. Cutting the square along parallel lines of two directions and the horizon leaves at most
/// seven corners; rounding may leave a few more.
struct Piece {
  std::array<Vertex, 16> vertices;
  std::size_t count = 0;

  void add(const Vertex& vertex) {
    if (count < vertices.size()) vertices[count++] = vertex;
  }
};

Vertex between(const Vertex& p, const Vertex& q, float t) {
  return {p.x + t * (q.x - p.x), p.y + t * (q.y - p.y), p.a + t * (q.a - p.a), p.b + t * (q.b - p.b),
          p.c + t * (q.c - p.c)};
}

/// The part where `side` is not negative (Sutherland and Hodgman, "Reentrant polygon clipping", CACM 1974).
template <class Side>
void cut(const Piece& from, const Side& side, Piece& to) {
  to.count = 0;
  if (from.count == 0) return;
  const Vertex* last = &from.vertices[from.count - 1];
  float last_side = side(*last);
  for (std::size_t i = 0; i < from.count; ++i) {
    const Vertex& next = from.vertices[i];
    const float next_side = side(next);
    if ((last_side >= 0) != (next_side >= 0))
      to.add(between(*last, next, last_side / (last_side - next_side)));
    if (next_side >= 0) to.add(next);
    last = &next;
    last_side = next_side;
  }
}

/// Shoelace formula, relative to the first corner.
float area(const Piece& piece) {
  float twice = 0;
  for (std::size_t i = 2; i < piece.count; ++i) {
    const Vertex& o = piece.vertices[0];
    const Vertex& p = piece.vertices[i - 1];
    const Vertex& q = piece.vertices[i];
    twice += (p.x - o.x) * (q.y - o.y) - (p.y - o.y) * (q.x - o.x);
  }
  return twice / 2;
}

/// Share of the pixel's square in which a value, linear between its corners, is not negative.
float share_of_square(const float (&f)[4]) {
  constexpr float kX[5] = {0, 1, 1, 0, 0};
  constexpr float kY[5] = {0, 0, 1, 1, 0};
  float twice = 0;
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  int count = 0;
  const auto add = [&](float x, float y) {
    if (count == 0) {
      x0 = x;
      y0 = y;
    } else if (count > 1) {
      twice += (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0);
    }
    x1 = x;
    y1 = y;
    ++count;
  };
  for (int i = 0; i < 4; ++i) {
    const float here = f[i];
    const float next = f[(i + 1) & 3];
    if (here >= 0) add(kX[i], kY[i]);
    if ((here >= 0) != (next >= 0)) {
      const float t = here / (here - next);
      add(kX[i] + t * (kX[i + 1] - kX[i]), kY[i] + t * (kY[i + 1] - kY[i]));
    }
  }
  return twice / 2;
}

PixelShare of_cell(const PatternGrid& grid, int row, int column) {
  return {grid.covers(row, column) ? 1.0F : 0.0F, grid.level(row, column)};
}

/// One line through the pixel: `beyond` of it lies past the line.
PixelShare mixed(const PixelShare& before, const PixelShare& after, float beyond) {
  return {before.covered + beyond * (after.covered - before.covered),
          before.level + beyond * (after.level - before.level)};
}

/// The area of the pixel past column line i and row line j, for all i and j of the span; from these sums the
/// areas of the cells follow as differences.
class PastLines {
 public:
  PastLines(const PatternGrid& grid, const PlanePoint (&corners)[4], const CellSpan& span)
      : grid_(grid), span_(span) {
    constexpr float kX[4] = {0, 1, 1, 0};
    constexpr float kY[4] = {0, 0, 1, 1};
    bool horizon = false;
    for (std::size_t i = 0; i < 4; ++i) {
      column_.add({kX[i], kY[i], corners[i].a, corners[i].b, corners[i].c});
      horizon = horizon || corners[i].c < kHorizon;
    }
    if (!horizon) return;
    cut(
        column_, [](const Vertex& v) { return v.c - kHorizon; }, spare_);
    column_ = spare_;
  }

  PixelShare sum() {
    PixelShare total;
    Areas now{};
    Areas next{};
    fill(now);
    for (int column = span_.column_low; column <= span_.column_high; ++column) {
      next.fill(0);
      if (column < span_.column_high) {
        cut_at_column(column);
        fill(next);
      }
      add_column(column, now, next, total);
      now = next;
    }
    return total;
  }

 private:
  using Areas = std::array<float, kMostColumns>;

  void cut_at_column(int column) {
    const float line = grid_.column_line(column);
    cut(
        column_, [line](const Vertex& v) { return v.a - line * v.c; }, spare_);
    column_ = spare_;
  }

  void fill(Areas& areas) {
    Piece piece = column_;
    areas[0] = area(piece);
    for (int row = span_.row_low; row < span_.row_high; ++row) {
      const float line = grid_.row_line(row);
      cut(
          piece, [line](const Vertex& v) { return v.b - line * v.c; }, spare_);
      piece = spare_;
      areas[row_major(row - span_.row_low, 1, 1)] = area(piece);
    }
  }

  void add_column(int column, const Areas& now, const Areas& next, PixelShare& total) const {
    for (int row = span_.row_low; row <= span_.row_high; ++row) {
      const auto i = static_cast<std::size_t>(row - span_.row_low);
      const bool last = row == span_.row_high;
      const float here = (now[i] - next[i]) - (last ? 0.0F : now[i + 1] - next[i + 1]);
      const PixelShare cell = of_cell(grid_, row, column);
      total.covered += here * cell.covered;
      total.level += here * cell.level;
    }
  }

  const PatternGrid& grid_;
  const CellSpan& span_;
  Piece column_;
  Piece spare_;
};

}  // namespace

PixelShare share_of_pixel(const PatternGrid& grid, const PlanePoint (&corners)[4], const CellSpan& span) {
  assert(grid.cells <= PatternGrid::kMostCells);
  const int columns = span.column_high - span.column_low;
  const int rows = span.row_high - span.row_low;
  if (columns + rows > 1) return PastLines(grid, corners, span).sum();
  const PixelShare before = of_cell(grid, span.row_low, span.column_low);
  const PixelShare after = of_cell(grid, span.row_high, span.column_high);
  if (before.covered == after.covered && before.level == after.level) return before;
  float past[4];
  if (columns == 1) {
    const float line = grid.column_line(span.column_low);
    for (std::size_t i = 0; i < 4; ++i) past[i] = corners[i].a - line * corners[i].c;
  } else {
    const float line = grid.row_line(span.row_low);
    for (std::size_t i = 0; i < 4; ++i) past[i] = corners[i].b - line * corners[i].c;
  }
  return mixed(before, after, share_of_square(past));
}

}  // namespace waymark::render

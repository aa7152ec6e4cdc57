#include "waymark/plot/tag_outline.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace waymark::plot {
namespace {

using Loops = std::vector<std::vector<Point>>;

/// Even-odd rule, using a ray to the right.
bool inside(const Loops& loops, double x, double y) {
  bool in = false;
  for (const auto& loop : loops) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point& a = loop[i];
      const Point& b = loop[(i + 1) % loop.size()];
      if ((a.y_mm > y) != (b.y_mm > y) && x < a.x_mm + (y - a.y_mm) / (b.y_mm - a.y_mm) * (b.x_mm - a.x_mm))
        in = !in;
    }
  }
  return in;
}

/// Invariants of an outline whose cells are one millimetre wide.
void expect_outline(const Cells& cells) {
  const auto width = static_cast<double>(cells.width);
  const Loops loops = outline(cells, {0, 0, width, width});
  for (int y = 0; y < cells.width; ++y) {
    for (int x = 0; x < cells.width; ++x) {
      RC_ASSERT(inside(loops, x + 0.5, y + 0.5) == cells.at(x, y));
    }
  }
  std::set<std::tuple<int, int, int, int>> unit_sides;
  double doubled_area = 0.0;
  for (const auto& loop : loops) {
    RC_ASSERT(loop.size() >= 4U);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point& a = loop[i];
      const Point& b = loop[(i + 1) % loop.size()];
      const Point& c = loop[(i + 2) % loop.size()];
      doubled_area += a.x_mm * b.y_mm - b.x_mm * a.y_mm;
      RC_ASSERT((a.x_mm == b.x_mm) != (a.y_mm == b.y_mm));  // parallel to an axis, with non-zero length
      RC_ASSERT((b.x_mm == c.x_mm) == (a.y_mm == b.y_mm));  // every point is a corner
      const auto length = static_cast<int>(std::abs(b.x_mm - a.x_mm) + std::abs(b.y_mm - a.y_mm));
      for (int k = 0; k < length; ++k) {
        const auto at = [&](double p, double q, int step) {
          return static_cast<int>(p + (q - p) / length * step);
        };
        const int x0 = at(a.x_mm, b.x_mm, k), y0 = at(a.y_mm, b.y_mm, k), x1 = at(a.x_mm, b.x_mm, k + 1),
                  y1 = at(a.y_mm, b.y_mm, k + 1);
        RC_ASSERT(unit_sides.insert({std::min(x0, x1), std::min(y0, y1), std::max(x0, x1), std::max(y0, y1)})
                      .second);  // no edge occurs twice
      }
    }
  }
  RC_ASSERT(doubled_area == 2.0 * static_cast<double>(std::count(cells.ink.begin(), cells.ink.end(), true)));
}

TEST(Outline, EnclosesExactlyTheInkForAnyPattern) {
  EXPECT_TRUE(rc::check([] {
    Cells cells{*rc::gen::inRange(1, 9), {}};
    cells.ink = *rc::gen::container<std::vector<bool>>(static_cast<std::size_t>(cells.width * cells.width),
                                                       rc::gen::arbitrary<bool>());
    expect_outline(cells);
  }));
}

TEST(Outline, IsValidForTagsOfEveryFamily) {
  EXPECT_TRUE(rc::check([] {
    const FamilyId id = *rc::gen::elementOf(kAllFamilies);
    const int number = *rc::gen::inRange(0, static_cast<int>(family(id).codes.size()));
    expect_outline(tag_cells({id, number}));
  }));
}

TEST(Outline, IsAtTheGivenPosition) {
  const Loops loops = outline({2, {true, false, false, false}}, {10, 20, 8, 8});
  ASSERT_EQ(loops.size(), 1U);
  std::vector<Point> loop = loops.front();
  EXPECT_EQ(loop.size(), 4U);
  for (const Point& corner : {Point{10, 20}, Point{14, 20}, Point{14, 24}, Point{10, 24}}) {
    EXPECT_EQ(std::count(loop.begin(), loop.end(), corner), 1);
  }
}

TEST(TagCells, CellsOutsideTheTagStayWhite) {
  const Cells cells = tag_cells({FamilyId::TagCircle21h7, 0});
  EXPECT_EQ(cells.width, 9);
  EXPECT_FALSE(cells.ink.front());
  EXPECT_FALSE(cells.ink.back());
}

/// Kalibr draws the bits of its table row by row from the top left, most significant bit first, with black
/// for 0. Its tables are those of AprilTag 2: the code of tag 0 in each family.
TEST(TwoCellBorder, MatchesKalibr) {
  const std::vector<std::tuple<FamilyId, int, std::uint64_t>> first_codes = {
      {FamilyId::Tag36h11, 6, 0xd5d628584},
      {FamilyId::Tag25h9, 5, 0x155cbf1},
      {FamilyId::Tag16h5, 4, 0x231b}};
  for (const auto& [id, bits, code] : first_codes) {
    const Cells cells = two_cell_border({id, 0});
    ASSERT_EQ(cells.width, bits + 4);
    for (int y = 0; y < cells.width; ++y) {
      for (int x = 0; x < cells.width; ++x) {
        const bool border = std::min({x, y, cells.width - 1 - x, cells.width - 1 - y}) < 2;
        const int shift = bits * bits - 1 - ((y - 2) * bits + x - 2);
        const bool ink = border || ((code >> static_cast<unsigned>(shift)) & 1U) == 0;
        EXPECT_EQ(cells.at(x, y), ink) << to_string(id) << " " << x << " " << y;
      }
    }
  }
}

}  // namespace
}  // namespace waymark::plot

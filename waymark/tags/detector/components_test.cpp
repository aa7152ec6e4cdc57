#include "waymark/tags/detector/components.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark::search {
namespace {

struct Grid {
  int width = 0;
  int height = 0;
  std::vector<char> set;
  [[nodiscard]] bool at(int x, int y) const {
    return x >= 0 && y >= 0 && x < width && y < height && set[static_cast<std::size_t>(y * width + x)] != 0;
  }
};

BitPlane plane_of(const Grid& grid) {
  BitPlane plane;
  plane.width = grid.width;
  plane.height = grid.height;
  plane.words_a_row = static_cast<std::size_t>((grid.width + 63) / 64);
  plane.words.assign(plane.words_a_row * static_cast<std::size_t>(grid.height), 0);
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      if (!grid.at(x, y)) continue;
      const auto word = static_cast<std::size_t>(y) * plane.words_a_row + static_cast<std::size_t>(x / 64);
      plane.words[word] |= std::uint64_t{1} << static_cast<unsigned>(x % 64);
    }
  }
  return plane;
}

/// x0, x1, y0, y1 and area.
using Shape = std::array<int, 5>;

/// Works pixel by pixel, and shares no code with the implementation under test.
std::multiset<Shape> flooded(Grid grid, bool corners_too) {
  std::multiset<Shape> shapes;
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      if (!grid.at(x, y)) continue;
      Shape shape = {x, x + 1, y, y + 1, 0};
      std::vector<std::pair<int, int>> open = {{x, y}};
      grid.set[static_cast<std::size_t>(y * grid.width + x)] = 0;
      while (!open.empty()) {
        const auto [px, py] = open.back();
        open.pop_back();
        shape = {std::min(shape[0], px), std::max(shape[1], px + 1), std::min(shape[2], py),
                 std::max(shape[3], py + 1), shape[4] + 1};
        for (int dy = -1; dy <= 1; ++dy) {
          for (int dx = -1; dx <= 1; ++dx) {
            if ((dx != 0 && dy != 0 && !corners_too) || !grid.at(px + dx, py + dy)) continue;
            grid.set[static_cast<std::size_t>((py + dy) * grid.width + px + dx)] = 0;
            open.emplace_back(px + dx, py + dy);
          }
        }
      }
      shapes.insert(shape);
    }
  }
  return shapes;
}

std::multiset<Shape> labelled(const RunComponents& components) {
  std::multiset<Shape> shapes;
  for (std::int32_t i = 0; i < std::ssize(components.components()); ++i) {
    if (!components.is_root(i)) continue;
    const Component& c = components.components()[at(i)];
    int area = 0;
    int runs = 0;
    for (std::int32_t r = c.first; r >= 0; r = components.runs()[at(r)].next, ++runs) {
      area += components.runs()[at(r)].x1 - components.runs()[at(r)].x0;
    }
    EXPECT_EQ(area, c.area);
    EXPECT_EQ(runs, c.run_count);
    shapes.insert({c.x0, c.x1, c.y0, c.y1, c.area});
  }
  return shapes;
}

TEST(RunComponents, MatchAFloodFill) {
  Random random(5);
  RunComponents components;  // one workspace for all rounds
  for (int round = 0; round < 600; ++round) {
    Grid grid{1 + static_cast<int>(random.index(150)), 1 + static_cast<int>(random.index(20)), {}};
    const double density = random.uniform();
    for (int i = 0; i < grid.width * grid.height; ++i) grid.set.push_back(random.uniform() < density ? 1 : 0);
    components.label(plane_of(grid));
    ASSERT_EQ(labelled(components), flooded(grid, false)) << "round " << round;
    components.join_diagonals();
    ASSERT_EQ(labelled(components), flooded(grid, true)) << "round " << round;
  }
}

TEST(RunComponents, EverySecondRowStandsForTheRowBelow) {
  Random random(6);
  RunComponents every;
  RunComponents second;
  for (int round = 0; round < 200; ++round) {
    Grid grid{1 + static_cast<int>(random.index(150)), 1 + static_cast<int>(random.index(20)), {}};
    const double density = random.uniform();
    for (int i = 0; i < grid.width * grid.height; ++i) grid.set.push_back(random.uniform() < density ? 1 : 0);
    Grid twice{grid.width, 2 * grid.height, {}};
    for (int y = 0; y < twice.height; ++y) {
      for (int x = 0; x < twice.width; ++x) twice.set.push_back(grid.at(x, y / 2) ? 1 : 0);
    }
    BitPlane plane = plane_of(grid);
    plane.row_step = 2;
    every.label(plane_of(twice));
    second.label(plane, best_plane_kernels(), false);
    ASSERT_EQ(second.components().size(), every.components().size()) << "round " << round;
    for (std::size_t i = 0; i < every.components().size(); ++i) {
      const Component& a = every.components()[i];
      const Component& b = second.components()[i];
      ASSERT_EQ(std::tie(a.x0, a.x1, a.y0, a.y1, a.area, a.run_count),
                std::tie(b.x0, b.x1, b.y0, b.y1, b.area, b.run_count))
          << "round " << round;
    }
  }
}

TEST(RunComponents, SquaresThatTouchAtACornerAreSeparateUntilJoined) {
  Grid grid{8, 8, std::vector<char>(64, 0)};
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) grid.set[static_cast<std::size_t>(y * 8 + x)] = (x < 4) == (y < 4) ? 1 : 0;
  }
  RunComponents components;
  components.label(plane_of(grid));
  EXPECT_EQ(labelled(components).size(), 2U);
  components.join_diagonals();
  EXPECT_EQ(labelled(components).size(), 1U);
  EXPECT_TRUE(components.components().front().joined_diagonally);
}

}  // namespace
}  // namespace waymark::search

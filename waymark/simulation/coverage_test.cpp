#include "waymark/simulation/coverage.hpp"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark::photo {
namespace {

using Eigen::Vector2d;
using Polygon = std::vector<Vector2d>;

/// Positive for corners clockwise as seen (y down).
double area(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

/// The part with sign * (coordinate - limit) >= 0 (Sutherland and Hodgman).
Polygon clip(const Polygon& polygon, int axis, double limit, double sign) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    const double da = sign * (a[axis] - limit);
    const double db = sign * (b[axis] - limit);
    if (da >= 0) kept.push_back(a);
    if ((da < 0) != (db < 0)) kept.emplace_back(a + (b - a) * (da / (da - db)));
  }
  return kept;
}

/// The oracle: the polygon clipped to the cell.
double area_in_cell(const Polygon& polygon, int x, int y) {
  return area(clip(clip(clip(clip(polygon, 0, x, 1), 0, x + 1, -1), 1, y, 1), 1, y + 1, -1));
}

/// A random convex polygon, clockwise.
Polygon random_polygon(Random& random, double reach) {
  const Vector2d centre(random.uniform(-reach, 20 + reach), random.uniform(-reach, 15 + reach));
  const double radius = random.uniform(0.05, 12);
  const auto corners = 3 + random.index(6);
  Polygon polygon;
  double angle = random.uniform(0, 6);
  for (std::uint64_t i = 0; i < corners; ++i) {
    polygon.emplace_back(centre + radius * Vector2d(std::cos(angle), std::sin(angle)));
    angle += 2 * 3.14159265358979 / static_cast<double>(corners);
  }
  return polygon;
}

TEST(Coverage, IsTheClippedAreaInEveryCell) {
  Random random(1);
  Coverage coverage;
  for (int i = 0; i < 300; ++i) {
    const Polygon polygon = random_polygon(random, 10);
    coverage.reset(20, 15);
    coverage.add(polygon, 3);
    for (int y = 0; y < 15; ++y) {
      const auto row = coverage.finish_row(y);
      for (int x = 0; x < 20; ++x) {
        const double expected = area_in_cell(polygon, x, y);
        ASSERT_NEAR(row[static_cast<std::size_t>(x)].covered, expected, 1e-12);
        ASSERT_NEAR(row[static_cast<std::size_t>(x)].value, 3 * expected, 1e-11);
      }
    }
  }
}

TEST(Coverage, HoldsForUprightSidesOnCellLimitsAndOutside) {
  for (const auto& [left, right] :
       {std::pair{0.0, 4.0}, {-3.0, 2.5}, {1.25, 9.0}, {-5.0, 50.0}, {-5.0, -1.0}, {4.0, 6.0}}) {
    const Polygon box = {{left, -2}, {right, -2}, {right, 2.25}, {left, 2.25}};
    Coverage coverage;
    coverage.reset(4, 3);
    coverage.add(box, 1);
    for (int y = 0; y < 3; ++y) {
      const auto row = coverage.finish_row(y);
      for (int x = 0; x < 4; ++x)
        EXPECT_NEAR(row[static_cast<std::size_t>(x)].covered, area_in_cell(box, x, y), 1e-15);
    }
  }
}

TEST(Coverage, FarCornersKeepTheirDigits) {
  // A half plane whose limit crosses the grid, spanned by corners a million cells away.
  const Polygon half = {{-1e6, -1e6 + 3}, {1e6, 1e6 + 3}, {-1e6, 1e6 + 3}};
  Coverage coverage;
  coverage.reset(8, 8);
  coverage.add(half, 1);
  for (int y = 0; y < 8; ++y) {
    const auto row = coverage.finish_row(y);
    for (int x = 0; x < 8; ++x) {
      const double expected = y > x + 3 ? 1.0 : (y == x + 3 ? 0.5 : 0.0);  // below y = x + 3
      EXPECT_NEAR(row[static_cast<std::size_t>(x)].covered, expected, 1e-9) << x << ", " << y;
    }
  }
}

TEST(Coverage, PiecesThatTileAddUpToOne) {
  Random random(2);
  Coverage coverage;
  coverage.reset(10, 10);
  const std::array<Vector2d, 4> box = {Vector2d(-1, -1), Vector2d(11, -1), Vector2d(11, 11),
                                       Vector2d(-1, 11)};
  const Vector2d middle(random.uniform(2, 8), random.uniform(2, 8));
  for (std::size_t i = 0; i < 4; ++i) coverage.add(Polygon{box[i], box[(i + 1) % 4], middle}, 5);
  for (int y = 0; y < 10; ++y) {
    for (const Coverage::Cell& cell : coverage.finish_row(y)) {
      EXPECT_NEAR(cell.covered, 1, 1e-13);
      EXPECT_NEAR(cell.value, 5, 1e-12);
    }
  }
}

TEST(Coverage, AnticlockwiseTakesAway) {
  const Polygon triangle = {{1, 1}, {6, 2}, {3, 5}};
  const Polygon reversed(triangle.rbegin(), triangle.rend());
  Coverage coverage;
  coverage.reset(8, 8);
  coverage.add(triangle, 1);
  coverage.add(reversed, 1);
  for (int y = 0; y < 8; ++y) {
    for (const Coverage::Cell& cell : coverage.finish_row(y)) EXPECT_NEAR(cell.covered, 0, 1e-15);
  }
}

}  // namespace
}  // namespace waymark::photo

#include "waymark/plot/clip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace waymark::plot {
namespace {

constexpr double kInvisibleMm = 0.02;

/// The part of a segment inside the box, or nothing.
std::optional<std::pair<Point, Point>> clipped(const Point& a, const Point& b, const Box& box) {
  const double dx = b.x_mm - a.x_mm;
  const double dy = b.y_mm - a.y_mm;
  double enters = 0.0;
  double leaves = 1.0;
  const std::array<std::pair<double, double>, 4> sides = {{{-dx, a.x_mm - box.x_mm},
                                                           {dx, box.right_mm() - a.x_mm},
                                                           {-dy, a.y_mm - box.y_mm},
                                                           {dy, box.bottom_mm() - a.y_mm}}};
  for (const auto& [towards, room] : sides) {
    if (towards == 0.0 && room < 0.0) return std::nullopt;
    if (towards < 0.0) enters = std::max(enters, room / towards);
    if (towards > 0.0) leaves = std::min(leaves, room / towards);
  }
  if (!(enters <= leaves)) return std::nullopt;
  const auto at = [&](double share) { return Point{a.x_mm + share * dx, a.y_mm + share * dy}; };
  return std::pair(enters > 0.0 ? at(enters) : a, leaves < 1.0 ? at(leaves) : b);
}

bool apart(const Point& a, const Point& b) {
  return std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm) >= kInvisibleMm;
}

bool known(const Point& point) { return std::isfinite(point.x_mm) && std::isfinite(point.y_mm); }

}  // namespace

std::vector<std::vector<Point>> clipped_lines(const std::vector<Point>& points, const Box& box) {
  std::vector<std::vector<Point>> parts;
  std::optional<Point> last;  // where the pen is, on the page or off it
  bool drawing = false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& next = points[i];
    if (!known(next)) {
      last.reset();
      drawing = false;
      continue;
    }
    const bool ends = i + 1 == points.size() || !known(points[i + 1]);
    if (last && !ends && !apart(*last, next)) continue;
    if (last) {
      const auto segment = clipped(*last, next, box);
      if (segment && !drawing) parts.push_back({segment->first});
      if (segment) parts.back().push_back(segment->second);
      drawing = segment && segment->second == next;
    }
    last = next;
  }
  return parts;
}

}  // namespace waymark::plot

#include "waymark/tags/quads.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <span>

namespace waymark::search {
namespace {

/// Twice the area of the triangle a b c, positive when they run clockwise as seen in the image.
std::int64_t cross_at(const HullPoint& a, const HullPoint& b, const HullPoint& c) {
  return std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
}

std::int64_t squared_distance(const HullPoint& a, const HullPoint& b) {
  const std::int64_t dx = a.x - b.x;
  const std::int64_t dy = a.y - b.y;
  return dx * dx + dy * dy;
}

/// Adds a point to a chain that must keep turning one way: `kTurn` is 1 for clockwise, -1 for the other. The
/// end of the chain with it.
template <int kTurn>
HullPoint* extended(HullPoint* begin, HullPoint* end, const HullPoint& point) {
  while (end - begin > 1 && kTurn * cross_at(end[-2], end[-1], point) <= 0) --end;
  *end = point;
  return end + 1;
}

}  // namespace

void QuadFitter::make_hull(const RunComponents& components, const Component& component) {
  constexpr std::int32_t kFar = 1 << 20;
  const std::span<const Run> runs = components.runs();
  const int step = components.row_step();
  const auto rows = at((component.y1 - component.y0) / step);
  left_.assign(rows, kFar);
  right_.assign(rows, -kFar);
  for (std::int32_t i = component.first; i >= 0; i = runs[at(i)].next) {
    const Run& run = runs[at(i)];
    const std::size_t y = at((run.y - component.y0) / step);
    left_[y] = std::min<std::int32_t>(left_[y], run.x0);
    right_[y] = std::max<std::int32_t>(right_[y], run.x1);
  }
  left_chain_.resize(rows + 1);
  hull_.resize(2 * (rows + 1));
  HullPoint* left = left_chain_.data();
  HullPoint* right = hull_.data();
  for (std::size_t y = 0; y <= rows; ++y) {  // lines between rows
    const std::size_t above = y == 0 ? 0 : y - 1;
    const std::size_t below = std::min(y, rows - 1);
    const std::int32_t line = component.y0 + static_cast<std::int32_t>(y) * step;
    left = extended<-1>(left_chain_.data(), left, {std::min(left_[above], left_[below]), line});
    right = extended<1>(hull_.data(), right, {std::max(right_[above], right_[below]), line});
  }
  // Down the right side, up the left: clockwise.
  while (left != left_chain_.data()) *right++ = *--left;
  hull_.resize(static_cast<std::size_t>(right - hull_.data()));
}

double QuadFitter::hull_area() const {
  std::int64_t twice = 0;
  for (std::size_t i = 0; i < hull_.size(); ++i) {
    const HullPoint& a = hull_[i];
    const HullPoint& b = hull_[i + 1 < hull_.size() ? i + 1 : 0];
    twice += std::int64_t{a.x} * b.y - std::int64_t{b.x} * a.y;
  }
  return 0.5 * static_cast<double>(twice);
}

/// The hull point between two others that is farthest from the line through them, or -1.
int QuadFitter::farthest(int from, int to) const {
  const int count = static_cast<int>(hull_.size());
  const HullPoint a = hull_[at(to)];
  const std::int32_t dx = hull_[at(from)].x - a.x;
  const std::int32_t dy = hull_[at(from)].y - a.y;
  int best = -1;
  std::int64_t most = -1;
  for (int i = from + 1 == count ? 0 : from + 1; i != to; i = i + 1 == count ? 0 : i + 1) {
    const HullPoint& p = hull_[at(i)];
    const std::int64_t distance = std::abs(std::int64_t{dx} * (p.y - a.y) - std::int64_t{dy} * (p.x - a.x));
    if (distance > most) {
      most = distance;
      best = i;
    }
  }
  return best;
}

/// The hull point farthest from a place.
int QuadFitter::farthest_from(const HullPoint& from) const {
  const int count = static_cast<int>(hull_.size());
  int best = 0;
  std::int64_t most = -1;
  for (int i = 0; i < count; ++i) {
    const std::int64_t squared = squared_distance(hull_[at(i)], from);
    if (squared <= most) continue;
    most = squared;
    best = i;
  }
  return best;
}

/// Four points of the hull that are each as far as possible from the line through its neighbours.
bool QuadFitter::choose_corners(std::array<int, 4>& corner) const {
  const int count = static_cast<int>(hull_.size());
  HullPoint sum;
  for (const HullPoint& point : hull_) sum = {sum.x + point.x, sum.y + point.y};
  corner[0] = farthest_from({sum.x / count, sum.y / count});
  corner[2] = farthest_from(hull_[at(corner[0])]);
  corner[1] = farthest(corner[0], corner[2]);
  corner[3] = farthest(corner[2], corner[0]);
  if (corner[1] < 0 || corner[3] < 0) return false;
  bool changed = true;
  for (int round = 0; round < 4 && changed; ++round) {
    changed = false;
    for (std::size_t i = 0; i < 4; ++i) {
      const int before = corner.at((i + 3) % 4);
      const int after = corner.at((i + 1) % 4);
      if (before == after) return false;
      const int better = farthest(before, after);
      if (better < 0 || better == corner.at(i)) continue;
      const auto distance = [&](int k) {
        return std::abs(cross_at(hull_[at(after)], hull_[at(before)], hull_[at(k)]));
      };
      if (distance(better) <= distance(corner.at(i))) continue;
      corner.at(i) = better;
      changed = true;
    }
  }
  return true;
}

/// The longest straight part of the hull from one corner to another, or the line between them where that is
/// short.
Line QuadFitter::side(int from, int to) const {
  constexpr double kLeastShare = 0.3;  // of the side
  const int count = static_cast<int>(hull_.size());
  HullPoint begin = hull_[at(from)];
  HullPoint end = hull_[at(to)];
  auto most = static_cast<std::int64_t>(kLeastShare * kLeastShare *
                                        static_cast<double>(squared_distance(begin, end)));
  for (int k = from; k != to;) {
    const int next = k + 1 == count ? 0 : k + 1;
    const std::int64_t squared = squared_distance(hull_[at(k)], hull_[at(next)]);
    if (squared > most) {
      most = squared;
      begin = hull_[at(k)];
      end = hull_[at(next)];
    }
    k = next;
  }
  const Eigen::Vector2d normal(end.y - begin.y, begin.x - end.x);
  return {normal, normal.dot(Eigen::Vector2d(begin.x, begin.y))};
}

/// The quad whose sides are the hull's; false where the hull is none, within what cut corners take from it.
bool QuadFitter::fit_sides(const std::array<int, 4>& corner, double hull_area, Quad& quad) const {
  constexpr double kLeastShare = 0.88;   // of one area in the other
  constexpr float kLeastSide = 4;        // px
  constexpr float kLeastCorner = 0.08F;  // of the area
  constexpr double kFarCorner = 0.3;     // of the square root of the area, and
  constexpr double kFarPx = 3;
  std::array<Line, 4> sides;
  for (std::size_t i = 0; i < 4; ++i) sides.at(i) = side(corner.at(i), corner.at((i + 1) % 4));
  for (std::size_t i = 0; i < 4; ++i) {
    if (!intersect(sides.at((i + 3) % 4), sides.at(i), quad[i])) return false;
    const HullPoint& near = hull_[at(corner.at(i))];
    const Eigen::Vector2f moved =
        quad[i] - Eigen::Vector2f(static_cast<float>(near.x), static_cast<float>(near.y));
    if (moved.lpNorm<1>() > kFarCorner * std::sqrt(hull_area) + kFarPx) return false;
  }
  const float quad_area = area(quad);
  if (quad_area < kLeastShare * hull_area || hull_area < kLeastShare * quad_area) return false;
  for (std::size_t i = 0; i < 4; ++i) {
    if ((quad[i] - quad[(i + 1) % 4]).squaredNorm() < kLeastSide * kLeastSide) return false;
    if (cross_at(quad[i], quad[(i + 1) % 4], quad[(i + 2) % 4]) < kLeastCorner * quad_area) return false;
  }
  return true;
}

bool QuadFitter::fit(const RunComponents& components, const Component& component, Quad& quad) {
  constexpr double kLeastArea = 25;     // px
  constexpr double kFrameShare = 0.28;  // of the hull that a frame covers at least, or
  constexpr double kFrameWidth = 8;     // px along its side times this
  constexpr double kFull = 0.95;        // nothing in it, where it is larger than
  constexpr double kFullArea = 900;     // px
  make_hull(components, component);
  const double inside = hull_area();
  const double covered = component.area;
  if (inside < kLeastArea) return false;
  if (covered < std::min(kFrameShare * inside, kFrameWidth * std::sqrt(inside))) return false;
  if (inside > kFullArea && covered > kFull * inside) return false;
  std::array<int, 4> corner{};
  return choose_corners(corner) && fit_sides(corner, inside, quad);
}

}  // namespace waymark::search

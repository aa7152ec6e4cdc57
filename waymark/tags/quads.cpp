#include "waymark/tags/quads.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>

namespace waymark::search {
namespace {

/// Twice the area of the triangle a b c, positive when they run clockwise as seen in the image.
std::int64_t cross_at(const HullPoint& a, const HullPoint& b, const HullPoint& c) {
  return std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
}

/// Adds a point to a chain that must keep turning one way: `turn` is 1 for clockwise, -1 for the other.
void extend(std::vector<HullPoint>& chain, const HullPoint& point, int turn) {
  while (chain.size() > 1 && turn * cross_at(chain[chain.size() - 2], chain.back(), point) <= 0)
    chain.pop_back();
  chain.push_back(point);
}

}  // namespace

void QuadFitter::make_hull(const std::vector<Run>& runs, const Component& component) {
  constexpr std::int32_t kFar = 1 << 20;
  const auto rows = at(component.y1 - component.y0);
  left_.assign(rows, kFar);
  right_.assign(rows, -kFar);
  for (std::int32_t i = component.first; i >= 0; i = runs[at(i)].next) {
    const Run& run = runs[at(i)];
    const std::size_t y = at(run.y - component.y0);
    left_[y] = std::min<std::int32_t>(left_[y], run.x0);
    right_[y] = std::max<std::int32_t>(right_[y], run.x1);
  }
  left_chain_.clear();
  hull_.clear();
  for (std::size_t y = 0; y <= rows; ++y) {  // lines between rows
    const std::size_t above = y == 0 ? 0 : y - 1;
    const std::size_t below = std::min(y, rows - 1);
    const std::int32_t line = component.y0 + static_cast<std::int32_t>(y);
    extend(left_chain_, {std::min(left_[above], left_[below]), line}, -1);
    extend(hull_, {std::max(right_[above], right_[below]), line}, 1);
  }
  // Down the right side, up the left: clockwise.
  hull_.insert(hull_.end(), left_chain_.rbegin(), left_chain_.rend());
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

bool QuadFitter::choose_corners(double hull_area, Quad& quad) const {
  constexpr double kLeastShare = 0.80;   // of the hull
  constexpr float kLeastSide = 4;        // px
  constexpr float kLeastCorner = 0.08F;  // of the area
  const int count = static_cast<int>(hull_.size());
  HullPoint sum;
  for (const HullPoint& point : hull_) sum = {sum.x + point.x, sum.y + point.y};
  const auto farthest_from = [&](const HullPoint& from) {
    int best = 0;
    std::int64_t most = -1;
    for (int i = 0; i < count; ++i) {
      const std::int64_t dx = hull_[at(i)].x - from.x;
      const std::int64_t dy = hull_[at(i)].y - from.y;
      if (dx * dx + dy * dy <= most) continue;
      most = dx * dx + dy * dy;
      best = i;
    }
    return best;
  };
  std::array<int, 4> corner{};
  corner[0] = farthest_from({sum.x / count, sum.y / count});
  corner[2] = farthest_from(hull_[at(corner[0])]);
  corner[1] = farthest(corner[0], corner[2]);
  corner[3] = farthest(corner[2], corner[0]);
  if (corner[1] < 0 || corner[3] < 0) return false;
  bool changed = true;
  for (int round = 0; round < 4 && changed; ++round) {
    changed = false;
    for (std::size_t i = 0; i < 4; ++i) {
      const int before = corner[(i + 3) % 4];
      const int after = corner[(i + 1) % 4];
      if (before == after) return false;
      const int better = farthest(before, after);
      if (better < 0 || better == corner[i]) continue;
      const auto distance = [&](int k) {
        return std::abs(cross_at(hull_[at(after)], hull_[at(before)], hull_[at(k)]));
      };
      if (distance(better) <= distance(corner[i])) continue;
      corner[i] = better;
      changed = true;
    }
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const HullPoint& point = hull_[at(corner[i])];
    quad[i] = {static_cast<float>(point.x), static_cast<float>(point.y)};
  }
  const float quad_area = area(quad);
  if (quad_area < kLeastShare * hull_area) return false;
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
  make_hull(components.runs(), component);
  const double inside = hull_area();
  const double covered = component.area;
  if (inside < kLeastArea) return false;
  if (covered < std::min(kFrameShare * inside, kFrameWidth * std::sqrt(inside))) return false;
  if (inside > kFullArea && covered > kFull * inside) return false;
  return choose_corners(inside, quad);
}

}  // namespace waymark::search

#include "waymark/tags/quads.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace waymark::search {
namespace {

/// Adds a point to a chain that must keep turning one way: `turn` is 1 for clockwise, -1 for the other.
void extend(std::vector<Eigen::Vector2f>& chain, std::size_t begin, const Eigen::Vector2f& point,
            float turn) {
  while (chain.size() > begin + 1 && turn * cross_at(chain[chain.size() - 2], chain.back(), point) <= 0)
    chain.pop_back();
  chain.push_back(point);
}

}  // namespace

void QuadFitter::make_hull(const std::vector<Run>& runs, const Component& component) {
  constexpr float kFar = 1e9F;
  const auto lines = at(component.y1 - component.y0 + 1);
  left_.assign(lines, kFar);
  right_.assign(lines, -kFar);
  for (std::int32_t i = component.first; i >= 0; i = runs[at(i)].next) {
    const Run& run = runs[at(i)];
    const std::size_t y = at(run.y - component.y0);
    const auto x0 = static_cast<float>(run.x0);
    const auto x1 = static_cast<float>(run.x1);
    left_[y] = std::min(left_[y], x0);
    left_[y + 1] = std::min(left_[y + 1], x0);
    right_[y] = std::max(right_[y], x1);
    right_[y + 1] = std::max(right_[y + 1], x1);
  }
  left_chain_.clear();
  hull_.clear();
  for (std::size_t y = 0; y < lines; ++y) {
    const float row = static_cast<float>(component.y0) + static_cast<float>(y);
    extend(left_chain_, 0, {left_[y], row}, -1);
    extend(hull_, 0, {right_[y], row}, 1);
  }
  // Down the right side, up the left: clockwise.
  hull_.insert(hull_.end(), left_chain_.rbegin(), left_chain_.rend());
}

/// The hull point between two others that is farthest from the line through them, or -1.
int QuadFitter::farthest(int from, int to) const {
  const int count = static_cast<int>(hull_.size());
  int best = -1;
  float most = -1;
  for (int i = (from + 1) % count; i != to; i = (i + 1) % count) {
    const float distance = std::abs(cross_at(hull_[at(to)], hull_[at(from)], hull_[at(i)]));
    if (distance > most) {
      most = distance;
      best = i;
    }
  }
  return best;
}

bool QuadFitter::choose_corners(float hull_area, Quad& quad) const {
  constexpr float kLeastShare = 0.80F;   // of the hull
  constexpr float kLeastSide = 4;        // px
  constexpr float kLeastCorner = 0.08F;  // of the area
  const int count = static_cast<int>(hull_.size());
  Eigen::Vector2f middle = Eigen::Vector2f::Zero();
  for (const Eigen::Vector2f& point : hull_) middle += point;
  middle /= static_cast<float>(count);
  const auto farthest_from = [&](const Eigen::Vector2f& from) {
    int best = 0;
    for (int i = 1; i < count; ++i) {
      if ((hull_[at(i)] - from).squaredNorm() > (hull_[at(best)] - from).squaredNorm()) best = i;
    }
    return best;
  };
  std::array<int, 4> corner{};
  corner[0] = farthest_from(middle);
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
      if (distance(better) <= distance(corner[i]) + 1e-3F) continue;
      corner[i] = better;
      changed = true;
    }
  }
  for (std::size_t i = 0; i < 4; ++i) quad[i] = hull_[at(corner[i])];
  const float quad_area = area(quad);
  if (quad_area < kLeastShare * hull_area) return false;
  for (std::size_t i = 0; i < 4; ++i) {
    if ((quad[i] - quad[(i + 1) % 4]).squaredNorm() < kLeastSide * kLeastSide) return false;
    if (cross_at(quad[i], quad[(i + 1) % 4], quad[(i + 2) % 4]) < kLeastCorner * quad_area) return false;
  }
  return true;
}

bool QuadFitter::fit(const RunComponents& components, const Component& component, Quad& quad) {
  constexpr float kLeastArea = 25;      // px
  constexpr float kFrameShare = 0.28F;  // of the hull that a frame covers at least, or
  constexpr float kFrameWidth = 8;      // px along its side times this
  constexpr float kFull = 0.95F;        // nothing in it, where it is larger than
  constexpr float kFullArea = 900;      // px
  make_hull(components.runs(), component);
  if (hull_.size() < 4) return false;
  float hull_area = 0;
  for (std::size_t i = 0; i < hull_.size(); ++i) {
    const Eigen::Vector2f& a = hull_[i];
    const Eigen::Vector2f& b = hull_[(i + 1) % hull_.size()];
    hull_area += 0.5F * (a.x() * b.y() - b.x() * a.y());
  }
  const auto covered = static_cast<float>(component.area);
  if (hull_area < kLeastArea) return false;
  if (covered < std::min(kFrameShare * hull_area, kFrameWidth * std::sqrt(hull_area))) return false;
  if (hull_area > kFullArea && covered > kFull * hull_area) return false;
  return choose_corners(hull_area, quad);
}

}  // namespace waymark::search

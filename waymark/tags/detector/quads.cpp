#include "waymark/tags/detector/quads.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

namespace waymark::search {
namespace {

/// Twice the area of the triangle a b c, positive if clockwise in the image.
std::int64_t cross_at(const HullPoint& a, const HullPoint& b, const HullPoint& c) {
  return std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
}

std::int64_t squared_distance(const HullPoint& a, const HullPoint& b) {
  const std::int64_t dx = a.x - b.x;
  const std::int64_t dy = a.y - b.y;
  return dx * dx + dy * dy;
}

/// Adds a point to a chain that must always turn in the same direction: `kTurn` is 1 for clockwise, -1 for
/// counter-clockwise. Returns the new end of the chain.
template <int kTurn>
HullPoint* extended(HullPoint* begin, HullPoint* end, const HullPoint& point) {
  while (end - begin > 1 && kTurn * cross_at(end[-2], end[-1], point) <= 0) --end;
  *end = point;
  return end + 1;
}

}  // namespace

void QuadFitter::make_hull(const RunComponents& components, const Component& component) {
  constexpr std::int32_t kOutside = 1 << 20;
  const std::span<const Run> runs = components.runs();
  const int step = components.row_step();
  const auto rows = at((component.y1 - component.y0) / step);
  left_.assign(rows, kOutside);
  right_.assign(rows, -kOutside);
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
  for (std::size_t y = 0; y <= rows; ++y) {  // the lines between pixel rows
    const std::size_t above = y == 0 ? 0 : y - 1;
    const std::size_t below = std::min(y, rows - 1);
    const std::int32_t line = component.y0 + static_cast<std::int32_t>(y) * step;
    left = extended<-1>(left_chain_.data(), left, {std::min(left_[above], left_[below]), line});
    right = extended<1>(hull_.data(), right, {std::max(right_[above], right_[below]), line});
  }
  // Goes down the right side and up the left side, so the hull is clockwise.
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

/// The hull point between two others that is farthest from the line through them; -1 if there is none.
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

/// The hull point farthest from a given point.
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

/// Four points on the hull, each as far as possible from the line through its neighbours.
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

/// The longest straight part of the hull between two corners, or the line between them if that part is short.
Line QuadFitter::side(int from, int to) const {
  constexpr double kMinShare = 0.3;  // minimum share of the side
  const int count = static_cast<int>(hull_.size());
  HullPoint begin = hull_[at(from)];
  HullPoint end = hull_[at(to)];
  auto most =
      static_cast<std::int64_t>(kMinShare * kMinShare * static_cast<double>(squared_distance(begin, end)));
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

/// The quad formed by the sides of the hull. Returns false if the hull is not a quad, even allowing for cut
/// corners.
bool QuadFitter::fit_sides(const std::array<int, 4>& corner, double hull_area, Quad& quad) const {
  constexpr double kMinShare = 0.88;  // minimum share of either area that lies in the other
  constexpr float kMinSidePx = 4;
  constexpr float kMinCornerShare = 0.08F;  // share of the area
  constexpr double kMaxCornerShift = 0.3;   // share of the square root of the area, and
  constexpr double kMaxCornerShiftPx = 3;
  std::array<Line, 4> sides;
  for (std::size_t i = 0; i < 4; ++i) sides.at(i) = side(corner.at(i), corner.at((i + 1) % 4));
  for (std::size_t i = 0; i < 4; ++i) {
    if (!intersect(sides.at((i + 3) % 4), sides.at(i), quad[i])) return false;
    const HullPoint& near = hull_[at(corner.at(i))];
    const Eigen::Vector2f moved =
        quad[i] - Eigen::Vector2f(static_cast<float>(near.x), static_cast<float>(near.y));
    if (moved.lpNorm<1>() > kMaxCornerShift * std::sqrt(hull_area) + kMaxCornerShiftPx) return false;
  }
  const float quad_area = area(quad);
  if (quad_area < kMinShare * hull_area || hull_area < kMinShare * quad_area) return false;
  for (std::size_t i = 0; i < 4; ++i) {
    if ((quad[i] - quad[(i + 1) % 4]).squaredNorm() < kMinSidePx * kMinSidePx) return false;
    if (cross_at(quad[i], quad[(i + 1) % 4], quad[(i + 2) % 4]) < kMinCornerShare * quad_area) return false;
  }
  return true;
}

bool QuadFitter::fit(const RunComponents& components, const Component& component, Quad& quad) {
  constexpr double kMinAreaPx = 25;
  constexpr double kFrameShare = 0.28;  // minimum share of the hull that a frame covers, or
  constexpr double kFrameWidth = 8;     // minimum area in px, per px of its side
  constexpr double kFull = 0.95;        // if fuller than this, it is not a frame if its area exceeds
  constexpr double kFullArea = 900;     // px
  make_hull(components, component);
  const double inside = hull_area();
  const double covered = component.area;
  if (inside < kMinAreaPx) return false;
  if (covered < std::min(kFrameShare * inside, kFrameWidth * std::sqrt(inside))) return false;
  if (inside > kFullArea && covered > kFull * inside) return false;
  std::array<int, 4> corner{};
  return choose_corners(corner) && fit_sides(corner, inside, quad);
}

namespace {

/// An edge as a function of the coordinate along which it is longer: y(x) or x(y).
struct Course {
  bool level = true;  ///< whether the edge is longer along x
  float from = 0;     ///< [px] the smaller end along that coordinate
  float length = 0;   ///< [px] along that coordinate
  float slope = 0;
  float base = 0;
  int outward = 1;  ///< direction in which the other coordinate points out of the quad

  Course(const Eigen::Vector2f& a, const Eigen::Vector2f& b) {
    const Eigen::Vector2f d = b - a;
    level = std::abs(d.x()) >= std::abs(d.y());
    const int along = level ? 0 : 1;
    const int across = 1 - along;
    length = std::abs(d[along]);
    from = std::min(a[along], b[along]);
    slope = length > 0 ? d[across] / d[along] : 0;
    base = a[across] - slope * a[along];
    outward = level ? (d.x() > 0 ? -1 : 1) : (d.y() > 0 ? 1 : -1);  // because the quad is clockwise
  }
};

/// Sums for fitting a weighted straight line to points (t, m).
struct LineSums {
  double w = 0, t = 0, m = 0, tt = 0, tm = 0;
  int count = 0;

  void add(double weight, double at, double value) {
    w += weight;
    t += weight * at;
    m += weight * value;
    tt += weight * at * at;
    tm += weight * at * value;
    ++count;
  }
};

/// The squared steps outwards along one row or column of pixels, and their sum weighted by position.
struct Crossing {
  std::int64_t weight = 0;
  std::int64_t place = 0;
};

Crossing crossing(const std::uint8_t* pixel, std::ptrdiff_t step, int count, int outward) {
  Crossing sum;
  int before = *pixel;
  for (int k = 1; k <= count; ++k) {
    pixel += step;
    const std::int64_t rise = std::max((*pixel - before) * outward, 0);
    before = *pixel;
    sum.weight += rise * rise;
    sum.place += rise * rise * k;
  }
  return sum;
}

/// Position of the largest change along one row or column: `place`, at `t` along the edge.
struct CrossingPoint {
  double weight = 0, t = 0, place = 0;
};

/// At most twice the largest value of EdgeSearch::crossings.
using CrossingPoints = std::array<CrossingPoint, 64>;

/// Keeps the points near a line through two of them, chosen so that as many points as possible are near it.
std::size_t keep_majority(CrossingPoints& points, std::size_t count, double near_px) {
  const std::size_t apart = std::max<std::size_t>(count / 3, 1);
  const auto is_near = [&](const CrossingPoint& a, const CrossingPoint& b, const CrossingPoint& p) {
    const double slope = (b.place - a.place) / (b.t - a.t);
    return std::abs(a.place + slope * (p.t - a.t) - p.place) < near_px;
  };
  std::size_t most = 0;
  CrossingPoint first;
  CrossingPoint second;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = i + apart; k < count; ++k) {
      std::size_t near = 0;
      for (std::size_t j = 0; j < count; ++j) near += is_near(points[i], points[k], points[j]) ? 1U : 0U;
      if (near <= most) continue;
      most = near;
      first = points[i];
      second = points[k];
    }
  }
  std::size_t kept = 0;
  for (std::size_t j = 0; j < count && most > 0; ++j) {
    if (is_near(first, second, points[j])) points[kept++] = points[j];
  }
  return kept;
}

std::size_t find_crossings(const ImageView& image, const Course& course, const EdgeSearch& search,
                           CrossingPoints& points) {
  constexpr float kTrim = 0.12F;  // share of the edge skipped at each end, because corners are round
  // The weight of one crossing is limited, so that a highlight does not outweigh the edge.
  constexpr std::int64_t kMaxWeight = 4000;
  constexpr std::int64_t kMinWeight = 9;  // weight of a step of 3 grey levels
  const float trim = std::max(0.5F, kTrim * course.length);
  int first = static_cast<int>(std::ceil(course.from + trim - 0.5F));
  int last = static_cast<int>(std::floor(course.from + course.length - trim - 0.5F));
  if (last - first < 1) {
    first = static_cast<int>(course.from + 0.25F * course.length);
    last = static_cast<int>(course.from + 0.75F * course.length);
  }
  const int step = std::max(1, (last - first + 1) / search.crossings);
  const int reach = static_cast<int>(std::ceil(search.reach_px * std::sqrt(1 + course.slope * course.slope)));
  const int along_limit = course.level ? image.width : image.height;
  const int across_limit = course.level ? image.height : image.width;
  const std::ptrdiff_t stride = course.level ? image.stride : 1;
  std::size_t count = 0;
  for (int t = std::max(first, 0); t <= std::min(last, along_limit - 1) && count < points.size(); t += step) {
    const float middle = course.base + course.slope * (static_cast<float>(t) + 0.5F);
    const int near = static_cast<int>(std::floor(middle - 0.5F));
    const int low = std::max(near - reach, 0);
    const int high = std::min(near + 1 + reach, across_limit - 1);
    if (high - low < 2) continue;
    const std::uint8_t* pixel = course.level ? image.row(low) + t : image.row(t) + low;
    const Crossing found = crossing(pixel, stride, high - low, course.outward * search.sign);
    if (found.weight < kMinWeight) continue;
    const double place = low + static_cast<double>(found.place) / static_cast<double>(found.weight);
    points[count++] = {static_cast<double>(std::min(found.weight, kMaxWeight)), t + 0.5, place};
  }
  return count;
}

bool find_line(const ImageView& image, const Course& course, const EdgeSearch& search, Line& line) {
  constexpr float kNearShare = 0.15F;  // share of the reach
  if (course.length < 3) return false;
  CrossingPoints points;
  std::size_t count = find_crossings(image, course, search, points);
  if (search.majority) count = keep_majority(points, count, std::max(0.5F, kNearShare * search.reach_px));
  LineSums sums;
  for (std::size_t i = 0; i < count; ++i) sums.add(points[i].weight, points[i].t, points[i].place);
  const double spread = sums.w * sums.tt - sums.t * sums.t;
  if (sums.count < 2 || spread < 1e-6) return false;
  const double slope = (sums.w * sums.tm - sums.t * sums.m) / spread;
  const double base = (sums.m - slope * sums.t) / sums.w;
  line.normal = course.level ? Eigen::Vector2d(-slope, 1) : Eigen::Vector2d(1, -slope);
  line.offset = base;
  return true;
}

}  // namespace

bool intersect(const Line& a, const Line& b, Eigen::Vector2f& point) {
  const double det = a.normal.x() * b.normal.y() - a.normal.y() * b.normal.x();
  if (std::abs(det) < 1e-4 * a.normal.norm() * b.normal.norm()) return false;
  const double x = (a.offset * b.normal.y() - a.normal.y() * b.offset) / det;
  const double y = (a.normal.x() * b.offset - a.offset * b.normal.x()) / det;
  point = {static_cast<float>(x), static_cast<float>(y)};
  return true;
}

bool sharpen_edges(const ImageView& image, const EdgeSearch& search, Quad& quad) {
  constexpr float kCornerExtraPx = 1.5F;  // [px] by which a corner may move farther than its edges
  std::array<Line, 4> lines;
  Quad moved;
  const auto corner = [&](std::size_t i, const Line& before, const Line& after) {
    return intersect(before, after, moved[i]) &&
           (moved[i] - quad[i]).cwiseAbs().maxCoeff() <= search.reach_px + kCornerExtraPx;
  };
  for (std::size_t i = 0; i < 4; ++i) {  // most quads in clutter are rejected at the first corners
    if (!find_line(image, Course(quad[i], quad[(i + 1) % 4]), search, lines[i])) return false;
    if (i > 0 && !corner(i, lines[i - 1], lines[i])) return false;
  }
  if (!corner(0, lines[3], lines[0])) return false;
  quad = moved;
  return true;
}

}  // namespace waymark::search

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "waymark/tags/quads.hpp"

namespace waymark::search {
namespace {

/// An edge as a function of the coordinate along which it is longer: y(x) or x(y).
struct Course {
  bool level = true;  ///< along x
  float from = 0;     ///< [px] the lesser end
  float length = 0;   ///< [px] along that coordinate
  float slope = 0;
  float base = 0;
  int outward = 1;  ///< direction in which the other coordinate leaves the quad

  Course(const Eigen::Vector2f& a, const Eigen::Vector2f& b) {
    const Eigen::Vector2f d = b - a;
    level = std::abs(d.x()) >= std::abs(d.y());
    const int along = level ? 0 : 1;
    const int across = 1 - along;
    length = std::abs(d[along]);
    from = std::min(a[along], b[along]);
    slope = length > 0 ? d[across] / d[along] : 0;
    base = a[across] - slope * a[along];
    outward = level ? (d.x() > 0 ? -1 : 1) : (d.y() > 0 ? 1 : -1);  // the quad runs clockwise
  }
};

/// Sums of a weighted straight line through points (t, m).
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

/// The squared steps outwards along one row or column of pixels, and their sum weighted by place.
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

/// Where the image changes most along one row or column: `place` at `t` along the edge.
struct CrossingPoint {
  double weight = 0, t = 0, place = 0;
};

/// No more than twice the largest EdgeSearch::crossings.
using CrossingPoints = std::array<CrossingPoint, 64>;

/// Leaves those near the line through two of them that most are near.
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
  constexpr float kTrim = 0.12F;              // of the edge at each end, where the corner is round
  constexpr std::int64_t kMostWeight = 4000;  // of one crossing: a glint must not outweigh the edge
  constexpr std::int64_t kLeastWeight = 9;    // a step of 3 grey levels
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
    if (found.weight < kLeastWeight) continue;
    const double place = low + static_cast<double>(found.place) / static_cast<double>(found.weight);
    points[count++] = {static_cast<double>(std::min(found.weight, kMostWeight)), t + 0.5, place};
  }
  return count;
}

bool find_line(const ImageView& image, const Course& course, const EdgeSearch& search, Line& line) {
  constexpr float kNear = 0.15F;  // of the reach
  if (course.length < 3) return false;
  CrossingPoints points;
  std::size_t count = find_crossings(image, course, search, points);
  if (search.majority) count = keep_majority(points, count, std::max(0.5F, kNear * search.reach_px));
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
  constexpr float kMore = 1.5F;  // [px] a corner may move further than its edges
  std::array<Line, 4> lines;
  Quad moved;
  const auto corner = [&](std::size_t i, const Line& before, const Line& after) {
    return intersect(before, after, moved[i]) &&
           (moved[i] - quad[i]).cwiseAbs().maxCoeff() <= search.reach_px + kMore;
  };
  for (std::size_t i = 0; i < 4; ++i) {  // most quads of clutter end at the first corners
    if (!find_line(image, Course(quad[i], quad[(i + 1) % 4]), search, lines[i])) return false;
    if (i > 0 && !corner(i, lines[i - 1], lines[i])) return false;
  }
  if (!corner(0, lines[3], lines[0])) return false;
  quad = moved;
  return true;
}

}  // namespace waymark::search

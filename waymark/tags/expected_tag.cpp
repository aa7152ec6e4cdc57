#include "waymark/tags/expected_tag.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>

#include "waymark/families/family.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

double apart_px(const Corners& a, const Corners& b) { return (center_px(a) - center_px(b)).norm(); }

/// Half the cross product of the diagonals; negative where the corners run the other way round.
double area_px2(const Corners& c) {
  const Eigen::Vector2d a = c[2] - c[0];
  const Eigen::Vector2d b = c[3] - c[1];
  return 0.5 * (a.x() * b.y() - a.y() * b.x());
}

/// Range of the levels in a part of a picture, and the greatest difference of neighbours.
struct Levels {
  int low = 255;
  int high = 0;
  int steepest = 0;
};

Levels levels_in(const ImageView& image, const Eigen::AlignedBox2d& box) {
  const int x0 = static_cast<int>(box.min().x());
  const int y0 = static_cast<int>(box.min().y());
  const int x1 = std::min(static_cast<int>(box.max().x()) + 1, image.width);
  const int y1 = std::min(static_cast<int>(box.max().y()) + 1, image.height);
  Levels levels;
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const int level = image.row(y)[x];
      levels.low = std::min(levels.low, level);
      levels.high = std::max(levels.high, level);
      if (x > x0) levels.steepest = std::max(levels.steepest, std::abs(level - image.row(y)[x - 1]));
      if (y > y0) levels.steepest = std::max(levels.steepest, std::abs(level - image.row(y - 1)[x]));
    }
  }
  return levels;
}

}  // namespace

Eigen::AlignedBox2d box_of(const Corners& corners_px) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : corners_px) box.extend(corner);
  return box;
}

bool usable(const ExpectedTag& expected, const ImageView& image) {
  const Corners& corners = expected.corners_px;
  if (!std::ranges::all_of(corners, [](const auto& corner) { return corner.allFinite(); })) return false;
  const Eigen::AlignedBox2d box = box_of(corners);
  const bool in_view =
      (box.max().array() > 0).all() && box.min().x() < image.width && box.min().y() < image.height;
  return in_view && box.sizes().maxCoeff() < 2.0 * std::max(image.width, image.height) &&
         area_px2(corners) > 1;
}

const TagDetection* nearest(const std::vector<TagDetection>& found, const ExpectedTag& expected) {
  const TagDetection* best = nullptr;
  for (const TagDetection& one : found) {
    if (one.tag != expected.tag) continue;
    if (best == nullptr ||
        apart_px(one.corners_px, expected.corners_px) < apart_px(best->corners_px, expected.corners_px))
      best = &one;
  }
  return best;
}

bool found_at(const std::vector<TagDetection>& found, const ExpectedTag& expected) {
  const TagDetection* near = nearest(found, expected);
  return near != nullptr &&
         apart_px(near->corners_px, expected.corners_px) < box_of(expected.corners_px).sizes().maxCoeff();
}

std::string_view to_string(MissReason reason) {
  switch (reason) {
    case MissReason::Outside:
      return "outside the picture";
    case MissReason::TooFaint:
      return "too faint";
    case MissReason::Blurred:
      return "blurred";
    case MissReason::Occluded:
      return "occluded";
  }
  return "";
}

MissReason why_missed(const ImageView& image, const ExpectedTag& expected, int cells_across,
                      int min_white_black_diff) {
  const Eigen::AlignedBox2d box = box_of(expected.corners_px);
  const bool inside =
      (box.min().array() >= 0).all() && box.max().x() <= image.width && box.max().y() <= image.height;
  if (!inside || !usable(expected, image)) return MissReason::Outside;
  const Levels levels = levels_in(image, box);
  if (levels.high - levels.low < min_white_black_diff) return MissReason::TooFaint;
  const double cell_px = std::sqrt(area_px2(expected.corners_px)) / cells_across;
  const double edge_px = static_cast<double>(levels.high - levels.low) / std::max(levels.steepest, 1);
  return edge_px > cell_px ? MissReason::Blurred : MissReason::Occluded;
}

std::vector<MissedTag> missed_tags(const ImageView& image, std::span<const ExpectedTag> expected,
                                   const std::vector<TagDetection>& found, int min_white_black_diff) {
  std::vector<MissedTag> missed;
  for (const ExpectedTag& tag : expected) {
    if (found_at(found, tag)) continue;
    const int cells = family(tag.tag.family).width_at_border;
    missed.push_back({tag, why_missed(image, tag, cells, min_white_black_diff)});
  }
  return missed;
}

}  // namespace waymark

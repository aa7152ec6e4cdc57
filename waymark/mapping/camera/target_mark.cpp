#include "waymark/mapping/camera/target_mark.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include "waymark/samples/visibility.hpp"

namespace waymark {

TargetMarks target_marks(std::span<const TagDetection> detections, const TagMap& target) {
  constexpr std::int64_t kNumbers = 1'000'000;
  TargetMarks marks;
  for (const TagDetection& detection : detections) {
    const MappedTag* tag = target.find(detection.tag);
    if (tag == nullptr || !usable_corners(detection)) continue;
    TargetMark mark{.key = kNumbers * static_cast<std::int64_t>(detection.tag.family) + detection.tag.number};
    for (const Eigen::Vector3d& corner : tag_corners(tag->size_m))
      mark.target_points_m.emplace_back(tag->map_T_tag * corner);
    mark.seen_px.assign(detection.corners_px.begin(), detection.corners_px.end());
    if (detection.corner_covariance_px2) mark.covariance_px2 = *detection.corner_covariance_px2;
    marks.push_back(std::move(mark));
  }
  return marks;
}

TargetMarks target_marks(std::span<const BoardCorner> corners, std::span<const Eigen::Vector2d> places_m) {
  TargetMarks marks;
  for (const BoardCorner& corner : corners) {
    const Eigen::Vector2d& place = places_m[static_cast<std::size_t>(corner.number)];
    marks.push_back(
        {.key = corner.number, .target_points_m = {{place.x(), place.y(), 0}}, .seen_px = {corner.px}});
  }
  return marks;
}

double apart_px(const TargetMarks& a, const TargetMarks& b) {
  std::map<std::int64_t, const TargetMark*> of_b;
  for (const TargetMark& mark : b) of_b.emplace(mark.key, &mark);
  double sum = 0;
  std::size_t points = 0;
  std::size_t shared = 0;
  for (const TargetMark& mark : a) {
    const auto other = of_b.find(mark.key);
    if (other == of_b.end()) continue;
    ++shared;
    for (std::size_t i = 0; i < std::min(mark.seen_px.size(), other->second->seen_px.size()); ++i, ++points)
      sum += (mark.seen_px[i] - other->second->seen_px[i]).norm();
  }
  if (points == 0 || 2 * shared < std::min(a.size(), b.size()))
    return std::numeric_limits<double>::infinity();
  return sum / static_cast<double>(points);
}

}  // namespace waymark

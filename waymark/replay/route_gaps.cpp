#include "waymark/replay/route_gaps.hpp"

#include <algorithm>

#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {

double longest_without_tags_m(const Trajectory& lap, const std::vector<TagFrame>& frames, const TagMap& map) {
  const auto sees_tag = [&](SensorTime stamp) {
    const auto at_once = std::ranges::equal_range(frames, stamp, {}, &TagFrame::stamp);
    return std::ranges::any_of(at_once, [&](const TagFrame& frame) {
      return std::ranges::any_of(frame.detections,
                                 [&](const TagDetection& seen) { return map.find(seen.tag) != nullptr; });
    });
  };
  double longest = 0;
  double since = 0;
  for (std::size_t i = 1; i < lap.size(); ++i) {
    since += (lap[i].map_T_base.translation() - lap[i - 1].map_T_base.translation()).norm();
    longest = std::max(longest, since);
    if (sees_tag(lap[i].stamp)) since = 0;
  }
  return longest;
}

double longest_without_tags_m(const Route& route, const TagMap& map,
                              const std::vector<MountedCamera>& cameras) {
  double longest = 0;
  double seen_at = 0;
  const SE3 map_T_level = map_T_floor(map.floor);
  for (const RoutePoint& point : route.points) {
    longest = std::max(longest, point.arc_length_m - seen_at);
    const SE3 map_T_base = map_T_level * lift(point.map_T_base);
    const bool seen = std::ranges::any_of(cameras, [&](const MountedCamera& each) {
      return !visible_tags(map, each.camera, map_T_base * each.base_T_cam).empty();
    });
    if (seen) seen_at = point.arc_length_m;
  }
  return std::max(longest, route.length_m - seen_at);
}

}  // namespace waymark

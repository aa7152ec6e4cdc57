#include "waymark/mapping/teach_chain.hpp"

#include <algorithm>
#include <limits>
#include <set>

#include <fmt/format.h>

#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

/// Two tags in one frame.
struct Link {
  double cost = std::numeric_limits<double>::infinity();  ///< sum of squared distances from the camera [m^2]
  SE3 from_T_to{};
};

using Links = std::map<TagId, std::map<TagId, Link>>;

std::vector<TagPoseObservation> trusted(const ObservedFrame& frame, const ChainOptions& options) {
  std::vector<TagPoseObservation> tags;
  std::ranges::copy_if(frame.tags, std::back_inserter(tags), [&](const TagPoseObservation& seen) {
    return seen.ambiguity_ratio <= options.max_ambiguity &&
           seen.cam_T_tag.translation().norm() <= options.max_distance_m;
  });
  return tags;
}

Links best_links(const std::vector<ObservedFrame>& frames, const ChainOptions& options) {
  Links links;
  for (const ObservedFrame& frame : frames) {
    const auto tags = trusted(frame, options);
    for (const auto& from : tags) {
      for (const auto& to : tags) {
        if (from.tag == to.tag) continue;
        const double cost =
            from.cam_T_tag.translation().squaredNorm() + to.cam_T_tag.translation().squaredNorm();
        Link& link = links[from.tag][to.tag];
        if (cost < link.cost) link = {cost, from.cam_T_tag.inverse() * to.cam_T_tag};
      }
    }
  }
  return links;
}

/// Dijkstra from the anchor; ties go to the smaller id, so the same lap gives the same map.
std::map<TagId, SE3> compose_from_anchor(const Links& links, const TagId& anchor, const SE3& map_T_anchor) {
  std::map<TagId, SE3> map_T_tag;
  std::map<TagId, double> cost = {{anchor, 0.0}};
  std::map<TagId, SE3> tentative = {{anchor, map_T_anchor}};
  std::set<std::pair<double, TagId>> queue = {{0.0, anchor}};
  while (!queue.empty()) {
    const TagId tag = queue.begin()->second;
    queue.erase(queue.begin());
    if (map_T_tag.contains(tag)) continue;
    map_T_tag[tag] = tentative.at(tag);
    const auto from = links.find(tag);
    if (from == links.end()) continue;
    for (const auto& [next, link] : from->second) {
      const double through = cost.at(tag) + link.cost;
      const auto known = cost.find(next);
      if (known != cost.end() && known->second <= through) continue;
      cost[next] = through;
      tentative[next] = map_T_tag.at(tag) * link.from_T_to;
      queue.insert({through, next});
    }
  }
  return map_T_tag;
}

/// From the nearest trusted tag of the map; nothing when the frame saw none.
std::optional<SE3> camera_from_nearest(const ObservedFrame& frame, const std::map<TagId, SE3>& map_T_tag,
                                       const ChainOptions& options) {
  std::optional<SE3> map_T_cam;
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& seen : trusted(frame, options)) {
    const auto tag = map_T_tag.find(seen.tag);
    const double distance = seen.cam_T_tag.translation().norm();
    if (tag == map_T_tag.end() || distance >= nearest) continue;
    nearest = distance;
    map_T_cam =
        tag->second * seen.cam_T_tag.inverse();  // equation 3.1, with any mapped tag in the anchor's place
  }
  return map_T_cam;
}

}  // namespace

ObservedFrame observe(const TagFrame& frame, const CameraModel& camera, const TagSizes& sizes) {
  ObservedFrame observed{.stamp = frame.stamp};
  for (const TagDetection& detection : frame.detections) {
    const Result<TagPose> pose = estimate_tag_pose(detection, sizes, camera);
    if (pose) observed.tags.push_back({detection.tag, pose->best.cam_T_tag, pose->ambiguity_ratio()});
  }
  return observed;
}

Result<ChainResult> map_by_chain(const std::vector<ObservedFrame>& frames, const TagId& anchor,
                                 const SE3& map_T_anchor, const TagSizes& sizes, const SE3& base_T_cam,
                                 const ChainOptions& options) {
  std::set<TagId> seen;
  for (const ObservedFrame& frame : frames) {
    for (const auto& tag : frame.tags) seen.insert(tag.tag);
  }
  if (!seen.contains(anchor)) {
    return fail(ErrorCode::NotFound,
                fmt::format("the anchor {} is never seen in this lap", to_string(anchor)), {},
                "Start and end the lap where the anchor is in view, or choose another with --anchor.");
  }
  const std::map<TagId, SE3> map_T_tag =
      compose_from_anchor(best_links(frames, options), anchor, map_T_anchor);
  ChainResult result;
  for (const TagId& tag : seen) {
    const auto found = map_T_tag.find(tag);
    const Result<double> size = sizes.size_m(tag);
    if (found == map_T_tag.end() || !size) {
      result.unconnected.push_back(tag);
      continue;
    }
    result.map.tags[tag] = {.map_T_tag = found->second, .size_m = *size};
  }
  const SE3 cam_T_base = base_T_cam.inverse();
  for (const ObservedFrame& frame : frames) {
    const auto map_T_cam = camera_from_nearest(frame, map_T_tag, options);
    if (map_T_cam) {
      result.trajectory.push_back({frame.stamp, *map_T_cam * cam_T_base});
    } else {
      ++result.frames_without_pose;
    }
  }
  return result;
}

}  // namespace waymark

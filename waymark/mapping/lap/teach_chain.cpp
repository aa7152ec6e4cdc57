#include "waymark/mapping/lap/teach_chain.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/lap/chain_islands.hpp"
#include "waymark/mapping/lap/chain_links.hpp"
#include "waymark/mapping/lap/floor_observations.hpp"

namespace waymark {
namespace {

using internal::Alternative;
using internal::FloorFrame;
using internal::Places;
using internal::TagShapes;
using internal::Vote;

constexpr double kGate3 = 16.3;  // 0.999 quantiles of chi-square: 3 degrees of freedom, a motion of the plane
constexpr double kGate6 =
    22.5;  // 0.999 quantile of chi-square, 6 degrees of freedom: one shape and a motion of the plane

Eigen::Matrix3d noise_of_places(const ChainOptions& options) {
  const Eigen::Vector3d sigmas(options.map_sigma_m, options.map_sigma_m, options.map_sigma_rad);
  return sigmas.cwiseAbs2().asDiagonal();
}

struct PlacedFrame {
  SensorTime stamp{};
  std::vector<Vote<SE2>> votes{};
  SE2 map_X_base{};
};

/// Where the frames just before and after say the base was: medians over as many on both sides. No robot is
/// somewhere else for the time of one frame.
Alternative<SE2> among_neighbours(const std::vector<PlacedFrame>& frames, std::size_t i) {
  constexpr std::size_t kNeighbours = 7;
  constexpr double kWindowSeconds = 0.6;
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> turned;
  std::size_t first = i - std::min(i, kNeighbours);
  std::size_t last = std::min(i + kNeighbours, frames.size() - 1);
  const std::size_t reach = std::min(i - first, last - i);
  const bool at_an_end = reach < kNeighbours / 2;
  if (!at_an_end) {
    first = i - reach;
    last = i + reach;
  }
  for (std::size_t k = first; k <= last; ++k) {
    if (std::abs(to_seconds(frames[k].stamp - frames[i].stamp)) > kWindowSeconds) continue;
    x.push_back(frames[k].map_X_base.x());
    y.push_back(frames[k].map_X_base.y());
    turned.push_back((frames[i].map_X_base.rotation().inverse() * frames[k].map_X_base.rotation()).angle());
  }
  const SE2 middle(median(x), median(y), frames[i].map_X_base.yaw() + median(turned));
  const double sigma_m = at_an_end ? 0.15 : 0.05;  // there the neighbours are all on one side
  const Eigen::Matrix3d scatter = Eigen::Vector3d(1, 1, 4).asDiagonal() * (sigma_m * sigma_m);
  return {middle, from_coordinate_covariance(middle, scatter).covariance.inverse()};
}

Trajectory trajectory_of(const std::vector<FloorFrame>& frames, const Places& places,
                         const ChainOptions& options, const SE3& map_T_floor) {
  std::vector<PlacedFrame> placed;
  const Eigen::Matrix3d noise = noise_of_places(options);
  for (const FloorFrame& frame : frames) {
    PlacedFrame here{frame.stamp, internal::votes_for_base(frame, places, noise)};
    const auto agreed = internal::agree(here.votes, kGate6);
    if (!agreed) continue;
    here.map_X_base = agreed->value.mean;
    placed.push_back(std::move(here));
  }
  Trajectory trajectory;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const Alternative<SE2> middle = among_neighbours(placed, i);
    // A jump: tags that showed the wrong one of their poses. They are asked again, near the neighbours.
    const bool jumps = internal::distance2(middle, placed[i].map_X_base) > kGate3;
    placed[i].votes.push_back({middle});
    const auto agreed =
        internal::agree_near(placed[i].votes, jumps ? middle.value : placed[i].map_X_base, kGate6);
    trajectory.push_back({placed[i].stamp, map_T_floor * lift(agreed ? agreed->value.mean : middle.value)});
  }
  return trajectory;
}

std::vector<ObservedFrame> near_tags(const std::vector<ObservedFrame>& frames, double max_distance_m) {
  std::vector<ObservedFrame> near = frames;
  for (ObservedFrame& frame : near) {
    std::erase_if(frame.tags, [&](const TagPoseObservation& seen) {
      return seen.cam_T_tag.translation().norm() > max_distance_m;
    });
  }
  return near;
}

}  // namespace

ObservedFrame observe(const TagFrame& frame, const CameraModel& camera, const TagSizes& sizes) {
  ObservedFrame observed{.stamp = frame.stamp};
  for (const TagDetection& detection : frame.detections) {
    const Result<TagPose> pose = estimate_tag_pose(detection, sizes, camera);
    if (!pose) continue;
    observed.tags.push_back({detection.tag, pose->best.cam_T_tag, pose->ambiguity_ratio(),
                             pose->best.covariance, pose->best.chi2, pose->other});
  }
  return observed;
}

Result<ChainResult> map_by_chain(const std::vector<ObservedFrame>& frames, const TagId& anchor,
                                 const SE3& map_T_anchor, const TagSizes& sizes, const SE3& base_T_cam,
                                 const ChainOptions& options, const std::vector<Odometry>& wheels) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  std::set<TagId> seen;
  for (const ObservedFrame& frame : frames) {
    for (const auto& tag : frame.tags) seen.insert(tag.tag);
  }
  const std::vector<ObservedFrame> near = near_tags(frames, options.max_distance_m);
  const TagShapes shapes = internal::tag_shapes(near, base_T_cam, options.floor);
  if (!shapes.contains(anchor) && seen.contains(anchor)) {
    return fail(ErrorCode::NotFound,
                fmt::format("the anchor {} is seen in this lap, but never within {} m", to_string(anchor),
                            options.max_distance_m),
                {}, "Is the size of the tags right? Otherwise raise --max-distance-m.");
  }
  if (!shapes.contains(anchor)) {
    return fail(ErrorCode::NotFound,
                fmt::format("the anchor {} is never seen in this lap", to_string(anchor)), {},
                "Start and end the lap where the anchor is in view, or choose another with --anchor.");
  }
  const auto on_floor = internal::floor_frames(near, shapes, base_T_cam, options.floor);
  const SE3& anchor_shape = shapes.at(anchor);
  const SE3 map_T_floor({}, {0, 0, map_T_anchor.translation().z() - anchor_shape.translation().z()});
  const SE2 map_X_anchor = project_to_plane(map_T_anchor * anchor_shape.inverse());
  const internal::Links links = internal::links_of(on_floor);
  Places places = internal::compose_from_anchor(links, anchor, map_X_anchor);
  if (options.spread_closing_error) internal::spread_closing_error(links, anchor, places);
  if (!wheels.empty())
    internal::place_islands(on_floor, links, OdometryTrack(wheels), noise_of_places(options),
                            options.spread_closing_error, places);
  ChainResult result;
  for (const TagId& tag : seen) {
    const auto place = places.find(tag);
    const Result<double> size = sizes.size_m(tag);
    if (place == places.end() || !size) {
      result.unconnected.push_back(tag);
      continue;
    }
    const SE3 map_T_tag =
        tag == anchor ? map_T_anchor : map_T_floor * lift(place->second.mean) * shapes.at(tag);
    result.map.tags[tag] = {.map_T_tag = map_T_tag, .size_m = *size};
  }
  result.trajectory = trajectory_of(on_floor, places, options, map_T_floor);
  result.frames_without_pose = static_cast<int>(frames.size() - result.trajectory.size());
  return result;
}

}  // namespace waymark

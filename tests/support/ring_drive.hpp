#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/lap/bundle_map.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

/// A robot that drives around a ring of tags with known poses, and a map with true poses.
namespace waymark::test {

struct RingShape {
  int tags = 12;
  double radius_m = 1;     ///< of the path
  double outside_m = 1.6;  ///< distance of the tags outside of it
  double loops = 1.1;
  double frame_m = 0.05;          ///< distance driven between frames, 0.1 s
  double stated_sigma_px = 0.05;  ///< of the covariance of the corners
  double noise_px = 0;            ///< noise added to the corners
  double odometry_distance = 1;   ///< ratio of odometry to true motion
  double odometry_yaw = 1;
  double odometry_sigma_m = 0, odometry_sigma_rad = 0;  ///< random, per frame
  bool rear = false;                                    ///< a second camera that looks back
  double tag_m = 0.16;
  std::uint64_t seed = 1;
};

struct RingDrive {
  LapInput lap;
  TagMap tags{};
  Trajectory truth{};      ///< by frame of the first camera
  std::vector<SE2> way{};  ///< the same in the plane
};

inline TagId ring_tag(int number) { return {FamilyId::Tag36h11, number}; }

inline CameraModel ring_camera() {
  return CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value();
}

/// Tag z points outwards: the tags are visible from inside.
inline TagMap ring_tags(const RingShape& shape) {
  TagMap map;
  for (int i = 0; i < shape.tags; ++i) {
    const double angle = 2 * std::numbers::pi * i / shape.tags;
    const double out_m = shape.radius_m + shape.outside_m;
    const SE3 at = lift(SE2(out_m * std::cos(angle), out_m * std::sin(angle), angle));
    map.tags[ring_tag(i)] = {.map_T_tag = at * SE3(body_R_optical(), {0, 0, 0.2 + 0.1 * (i % 3)}),
                             .size_m = shape.tag_m};
  }
  return map;
}

/// Tags in view of a camera at this base pose.
inline TagFrame ring_frame(const RingDrive& drive, const RingShape& shape, const MountedCamera& camera,
                           const StampedPose& base, Random& random) {
  TagFrame frame{.stamp = base.stamp, .camera = camera.name};
  const SE3 cam_T_map = (base.map_T_base * camera.base_T_cam).inverse();
  for (const auto& [id, tag] : drive.tags.tags) {
    const auto corners = visible_corners(camera.camera, cam_T_map * tag.map_T_tag, tag.size_m);
    if (!corners) continue;
    TagDetection seen{.tag = id, .decision_margin = 60, .corners_px = *corners};
    for (Eigen::Vector2d& corner : seen.corners_px) {
      corner.x() += shape.noise_px * random.normal();
      corner.y() += shape.noise_px * random.normal();
    }
    seen.corner_covariance_px2 =
        CornerCovariance(std::pow(shape.stated_sigma_px, 2) * CornerCovariance::Identity());
    frame.detections.push_back(seen);
  }
  return frame;
}

inline RingDrive drive_ring(const RingShape& shape = {}) {
  RingDrive drive{.lap = {.camera = ring_camera(),
                          .base_T_cam = SE3(body_R_optical(), {0.1, 0, 0.25}),
                          .sizes = {.default_size_m = shape.tag_m},
                          .anchor = ring_tag(0)}};
  drive.tags = ring_tags(shape);
  drive.lap.map_T_anchor = drive.tags.tags.at(ring_tag(0)).map_T_tag;
  if (shape.rear)
    drive.lap.more_cameras.push_back(
        {"rear", ring_camera(),
         SE3(SO3::from_rpy(0, 0, std::numbers::pi) * body_R_optical(), {-0.1, 0, 0.25})});
  Random random(shape.seed);
  SE2 odom;
  const SE2::Tangent step(shape.frame_m, 0, shape.frame_m / shape.radius_m);
  const auto frames = static_cast<int>(2 * std::numbers::pi * shape.radius_m * shape.loops / shape.frame_m);
  SE2 at(shape.radius_m, 0, std::numbers::pi / 2);
  for (int i = 0; i <= frames; ++i) {
    const SensorTime stamp{std::chrono::milliseconds(100 * i)};
    if (i > 0) {
      at = at * SE2::exp(step);
      SE2::Tangent measured(shape.odometry_distance * step[0], 0, shape.odometry_yaw * step[2]);
      measured[0] += shape.odometry_sigma_m * random.normal();
      measured[1] += shape.odometry_sigma_m * random.normal();
      measured[2] += shape.odometry_sigma_rad * random.normal();
      odom = odom * SE2::exp(measured);
    }
    drive.way.push_back(at);
    drive.truth.push_back({stamp, lift(at)});
    drive.lap.odometry.push_back({.stamp = stamp, .odom_T_base = odom});
    const MountedCamera first{"cam", drive.lap.camera, drive.lap.base_T_cam};
    drive.lap.frames.push_back(ring_frame(drive, shape, first, drive.truth.back(), random));
    for (const MountedCamera& other : drive.lap.more_cameras)
      drive.lap.frames.push_back(ring_frame(drive, shape, other, drive.truth.back(), random));
  }
  return drive;
}

/// Moves a tag in its own frame before this frame of the lap, and observes it there. `tags` then has its last
/// pose.
inline void move_tag(RingDrive& drive, const RingShape& shape, int number, const SE3& by, std::size_t frame) {
  MappedTag& tag = drive.tags.tags.at(ring_tag(number));
  tag.map_T_tag = tag.map_T_tag * by;
  Random random(1000 + shape.seed);
  for (std::size_t f = frame; f < drive.lap.frames.size(); ++f) {
    const TagFrame moved =
        ring_frame(drive, shape, {"cam", drive.lap.camera, drive.lap.base_T_cam}, drive.truth[f], random);
    std::vector<TagDetection>& seen = drive.lap.frames[f].detections;
    std::erase_if(seen, [&](const TagDetection& d) { return d.tag == ring_tag(number); });
    for (const TagDetection& detection : moved.detections) {
      if (detection.tag == ring_tag(number)) seen.push_back(detection);
    }
  }
}

/// Takes a tag away before this frame of the lap. Returns the number of its observations until the end.
inline int take_tag_away(RingDrive& drive, int number, std::size_t frame) {
  std::size_t gone = 0;
  for (std::size_t f = frame; f < drive.lap.frames.size(); ++f)
    gone += std::erase_if(drive.lap.frames[f].detections,
                          [&](const TagDetection& d) { return d.tag == ring_tag(number); });
  return static_cast<int>(gone);
}

/// The frames of the lap in order, as the mapper uses them.
inline std::vector<ObservedFrame> observed_frames(const LapInput& lap) {
  std::vector<ObservedFrame> observed;
  for (const TagFrame& frame : lap.frames) observed.push_back(observe(frame, lap));
  return observed;
}

/// A map with true poses and all observations in use.
inline BundleMap true_map(const RingDrive& drive) {
  BundleMap map{.map = drive.tags, .trajectory = drive.truth};
  for (auto& [id, tag] : map.map.tags) {
    tag.covariance = Matrix6(1e-6 * Matrix6::Identity());
    map.observations[id] = 0;
  }
  for (const TagFrame& frame : drive.lap.frames) {
    for (const TagDetection& seen : frame.detections) ++map.observations[seen.tag];
  }
  map.odometry_scales_sigma = {0.001, 0.001};
  return map;
}

/// A start of the search with true poses.
inline ChainResult true_start(const RingDrive& drive) {
  return {.map = drive.tags, .trajectory = drive.truth};
}

/// Rejects the observations of a tag in the frames [from, to).
inline void reject(const RingDrive& drive, const TagId& tag, std::size_t from, std::size_t to,
                   BundleMap& map) {
  for (std::size_t f = from; f < to && f < drive.lap.frames.size(); ++f) {
    for (const TagDetection& seen : drive.lap.frames[f].detections) {
      if (seen.tag != tag) continue;
      map.rejected.push_back({drive.lap.frames[f].stamp, tag, std::numeric_limits<double>::infinity()});
      --map.observations[tag];
    }
  }
}

}  // namespace waymark::test

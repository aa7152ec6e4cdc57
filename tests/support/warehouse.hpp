#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "waymark/base/random.hpp"
#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

/// A warehouse of any size: parallel aisles driven in order, with tags on signs along both sides.
namespace waymark::test {

struct WarehouseShape {
  int tags = 2000;
  double aisle_m = 35;      ///< length
  double pitch_m = 3;       ///< distance between aisles
  double sign_m = 0.7;      ///< distance between signs on one side
  double frame_m = 0.035;   ///< distance driven between frames
  double farthest_m = 7.5;  ///< maximum distance of a visible tag
  double tag_m = 0.25;      ///< side
  double corner_sigma_px = 0.1;
  std::uint64_t seed = 1;
};

struct Warehouse {
  LapInput lap;
  TagMap truth{};
  Trajectory path{};
  std::size_t detections = 0;
};

namespace internal {

/// Up one aisle, half a circle, down the next.
inline std::vector<SE2> warehouse_way(const WarehouseShape& shape, int aisles) {
  std::vector<SE2> way;
  SE2 at(0, 0, 0);
  for (int aisle = 0; aisle < aisles; ++aisle) {
    for (double s = 0; s < shape.aisle_m; s += shape.frame_m) {
      way.push_back(at);
      at = at * SE2(shape.frame_m, 0, 0);
    }
    if (aisle + 1 == aisles) break;
    const double radius = shape.pitch_m / 2;
    const double side = aisle % 2 == 0 ? 1 : -1;
    const int steps = static_cast<int>(std::numbers::pi * radius / shape.frame_m);
    for (int i = 0; i < steps; ++i) {
      way.push_back(at);
      at = at * SE2::exp({std::numbers::pi * radius / steps, 0, side * std::numbers::pi / steps});
    }
  }
  return way;
}

/// Signs rotated by 40 degrees from the aisle towards the oncoming robot.
inline TagMap warehouse_tags(const WarehouseShape& shape, int aisles) {
  TagMap map;
  const int per_side = static_cast<int>(shape.aisle_m / shape.sign_m);
  for (int aisle = 0; aisle < aisles; ++aisle) {
    const double heading = aisle % 2 == 0 ? 0 : std::numbers::pi;
    const SE2 start(aisle % 2 == 0 ? 0 : shape.aisle_m, aisle * shape.pitch_m, heading);
    for (int i = 0; i < 2 * per_side && std::ssize(map.tags) < shape.tags; ++i) {
      const double left = i % 2 == 0 ? 1 : -1;
      const SE2 sign = start * SE2(2.5 + shape.sign_m * (i / 2) + 0.2 * left, 1.0 * left, 0.5 * left);
      const SE3 map_T_tag = SE3(SO3::from_rpy(0, 0, sign.yaw()) * body_R_optical(),
                                Eigen::Vector3d(sign.x(), sign.y(), 0.3 + 0.15 * (i % 5)));
      map.tags[{FamilyId::TagStandard52h13, static_cast<int>(map.tags.size())}] = {map_T_tag, shape.tag_m};
    }
  }
  return map;
}

}  // namespace internal

/// Simulates the drive: noisy corners with their covariance, odometry 1 % off with noise. Occlusion is not
/// simulated. O(frames * visible tags).
inline Warehouse drive_warehouse(const WarehouseShape& shape) {
  const int per_aisle = 2 * static_cast<int>(shape.aisle_m / shape.sign_m);
  const int aisles = (shape.tags + per_aisle - 1) / per_aisle;
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value();
  Warehouse house{.lap = {.camera = camera,
                          .base_T_cam = SE3(body_R_optical(), Eigen::Vector3d(0.1, 0, 0.4)),
                          .sizes = {.default_size_m = shape.tag_m},
                          .anchor = {FamilyId::TagStandard52h13, 0}}};
  house.truth = internal::warehouse_tags(shape, aisles);
  house.lap.map_T_anchor = house.truth.tags.at(house.lap.anchor).map_T_tag;
  std::map<int, std::vector<TagId>> by_cell;  // cells of two metres along x and y, which separate the aisles
  const auto cell = [](double x, double y) {
    return static_cast<int>(std::floor(x / 2)) * 100000 + static_cast<int>(std::floor(y / 2));
  };
  for (const auto& [id, tag] : house.truth.tags)
    by_cell[cell(tag.map_T_tag.translation().x(), tag.map_T_tag.translation().y())].push_back(id);
  Random random(shape.seed);
  SE2 odom;
  const std::vector<SE2> way = internal::warehouse_way(shape, aisles);
  for (std::size_t i = 0; i < way.size(); ++i) {
    const SensorTime stamp{std::chrono::milliseconds(100 * static_cast<std::int64_t>(i))};
    const SE3 map_T_base = SE3(SO3::from_rpy(0, 0, way[i].yaw()), {way[i].x(), way[i].y(), 0});
    const SE3 cam_T_map = (map_T_base * house.lap.base_T_cam).inverse();
    if (i > 0) {
      SE2::Tangent motion = (way[i - 1].inverse() * way[i]).log();
      motion.x() = motion.x() / 1.01 + 0.0005 * random.normal();
      motion.z() += 0.001 * random.normal();
      odom = odom * SE2::exp(motion);
    }
    house.lap.odometry.push_back({stamp, odom});
    house.path.push_back({stamp, map_T_base});
    TagFrame frame{.stamp = stamp};
    const int reach = static_cast<int>(std::ceil(shape.farthest_m / 2));
    for (int dx = -reach; dx <= reach; ++dx) {
      for (int dy = -reach; dy <= reach; ++dy) {
        const auto here = by_cell.find(cell(way[i].x() + 2 * dx, way[i].y() + 2 * dy));
        if (here == by_cell.end()) continue;
        for (const TagId& id : here->second) {
          const SE3 cam_T_tag = cam_T_map * house.truth.tags.at(id).map_T_tag;
          if (cam_T_tag.translation().norm() > shape.farthest_m) continue;
          const auto corners = visible_corners(camera, cam_T_tag, shape.tag_m);
          if (!corners) continue;
          TagDetection detection{.tag = id, .decision_margin = 60, .corners_px = *corners};
          for (Eigen::Vector2d& corner : detection.corners_px)
            corner += shape.corner_sigma_px * Eigen::Vector2d(random.normal(), random.normal());
          detection.corner_covariance_px2 =
              CornerCovariance(std::pow(shape.corner_sigma_px, 2) * CornerCovariance::Identity());
          frame.detections.push_back(detection);
          ++house.detections;
        }
      }
    }
    house.lap.frames.push_back(std::move(frame));
  }
  return house;
}

}  // namespace waymark::test

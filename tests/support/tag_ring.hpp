#pragma once

#include <cmath>
#include <limits>
#include <numbers>

#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/localization/riekf_localizer.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

/// A robot that drives in a ring of tags, and the filter that receives its samples.
namespace waymark::testing {

inline SensorTime at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

inline MountedSensor mounted_sensor() {
  const PinholeRadtan lens{.fx = 440, .fy = 440, .cx = 320, .cy = 240, .k = {}, .coefficients = 0};
  return {CameraModel::make(lens, 640, 480).value(), SE3(body_R_optical(), {0.08, 0, 0.18})};
}

/// Sixteen upright tags in a ring, facing inwards, unevenly spaced.
inline TagMap ring() {
  TagMap map;
  for (int i = 0; i < 16; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.2 * std::sin(3.0 * i)) / 16;
    const SE2 place(2.5 * std::cos(angle), (2.2 + 0.3 * (i % 3)) * std::sin(angle), angle);
    map.tags[{.number = i}] = {.map_T_tag = lift(place) * SE3(body_R_optical(), {0, 0, 0.3}), .size_m = 0.16};
  }
  return map;
}

/// The true world, and the world given to the robot.
struct RingWorld {
  TagMap tags = ring();
  double wrong_id_share = 0;
  bool dark = false;
};

inline TagFrame observe(const RingWorld& world, const SE2& map_X_base, double seconds, Random& random) {
  TagFrame frame{.stamp = at(seconds)};
  if (world.dark) return frame;
  const SE3 cam_T_map = (lift(map_X_base) * mounted_sensor().base_T_sensor).inverse();
  for (const auto& [id, tag] : world.tags.tags) {
    const auto corners = visible_corners(*mounted_sensor().camera, cam_T_map * tag.map_T_tag, tag.size_m);
    if (!corners) continue;
    TagDetection seen{.tag = id, .corners_px = *corners};
    if (random.uniform() < world.wrong_id_share) seen.tag.number = static_cast<int>(random.index(16));
    for (auto& corner : seen.corners_px) corner += 0.15 * Eigen::Vector2d(random.normal(), random.normal());
    seen.corner_covariance_px2 = CornerCovariance::Identity() * 0.15 * 0.15;
    frame.detections.push_back(seen);
  }
  return frame;
}

/// A robot that drives in circles in the ring, with slightly wrong odometry.
struct RingRobot {
  SE2 truth{0, -1, 0};
  SE2 odom{};
  double seconds = 10;
  int steps = 0;

  Odometry drive(double dt_s, Random& random) {
    const Eigen::Vector3d u(0.3 * dt_s, 0, 0.3 * dt_s);
    truth = truth * SE2::exp(u);
    odom = odom * SE2::exp({1.02 * u.x() + 1e-3 * std::sqrt(dt_s) * random.normal(), 0,
                            u.z() + 1e-3 * std::sqrt(dt_s) * random.normal()});
    seconds += dt_s;
    ++steps;
    return {.stamp = at(seconds), .odom_T_base = odom, .speed_m_s = 0.3, .yaw_rate_rad_s = 0.3};
  }
};

inline void run(RiekfLocalizer& filter, RingRobot& robot, const RingWorld& world, double seconds,
                Random& random) {
  for (int i = 0; i < static_cast<int>(std::lround(seconds * 50)); ++i) {
    filter.add(robot.drive(0.02, random));
    if (robot.steps % 4 == 0) filter.add(observe(world, robot.truth, robot.seconds, random));
    filter.clear_comparisons();
  }
}

inline double off_m(const RiekfLocalizer& filter, const RingRobot& robot) {
  const auto estimate = filter.estimate();
  if (!estimate) return std::numeric_limits<double>::infinity();
  return (estimate->map_T_base.translation() - robot.truth.translation()).norm();
}

inline bool certain(const RiekfLocalizer& filter) { return filter.estimate() && filter.estimate()->certain; }

}  // namespace waymark::testing

#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>

#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/replay/speed_profile.hpp"
#include "waymark/samples/trajectory.hpp"

/// Laps and routes of simple shapes.
namespace waymark::test {

/// A drive around a circle of 2 m radius with noise, for the given number of turns, stationary at both ends.
inline Trajectory circle_lap(double sigma_m, double turns) {
  Random random(1);
  Trajectory trajectory;
  const auto add = [&](double angle) {
    const SE2 pose{2 * std::cos(angle) + sigma_m * random.normal(),
                   2 * std::sin(angle) + sigma_m * random.normal(), angle + std::numbers::pi / 2};
    trajectory.push_back(
        {SensorTime(Duration(static_cast<std::int64_t>(trajectory.size()) * 33'000'000)), lift(pose)});
  };
  for (int i = 0; i < 60; ++i) add(0);
  for (int i = 0; i < 1200; ++i) add(2 * std::numbers::pi * turns * i / 1200);
  for (int i = 0; i < 60; ++i) add(2 * std::numbers::pi * turns);
  return trajectory;
}

/// A figure of eight, a circle (closed), or a line (open) with points every 5 cm.
inline Route shaped_route(const std::string& shape, double speed_m_s) {
  Route route{.closed = shape != "line"};
  const int count = shape == "eight" ? 300 : 200;
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  for (int i = 0; i < count; ++i) {
    const double t = 2 * std::numbers::pi * i / count;
    Eigen::Vector2d p(2 * std::cos(t), 2 * std::sin(t));
    Eigen::Vector2d ahead(-std::sin(t), std::cos(t));
    double curvature = 0.5;
    if (shape == "line") {
      p = {0.05 * i, 0};
      ahead = {1, 0};
      curvature = 0;
    } else if (shape == "eight") {
      p = {2 * std::sin(t), 1.5 * std::sin(2 * t)};
      ahead = {2 * std::cos(t), 3 * std::cos(2 * t)};
      const Eigen::Vector2d bend(-2 * std::sin(t), -6 * std::sin(2 * t));
      curvature = (ahead.x() * bend.y() - ahead.y() * bend.x()) / std::pow(ahead.norm(), 3);
    }
    const double arc = i == 0 ? 0 : route.points.back().arc_length_m + (p - before).norm();
    const double yaw = std::atan2(ahead.y(), ahead.x()) + (speed_m_s < 0 ? std::numbers::pi : 0);
    route.points.push_back({SE2(p.x(), p.y(), yaw), arc, curvature, speed_m_s});
    before = p;
  }
  route.length_m = route.points.back().arc_length_m +
                   (route.closed ? (route.points[0].map_T_base.translation() - before).norm() : 0);
  return with_speed_profile(route, {});
}

}  // namespace waymark::test

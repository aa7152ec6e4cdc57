#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "waymark/base/random.hpp"
#include "waymark/localization/riekf_localizer.hpp"

/// A robot with a laser that drives in circles among eight numbered points, and the filter that it feeds.
namespace waymark::test {

inline SensorTime laser_time(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

/// Eight points on an irregular ring.
inline std::vector<LandmarkPoint> laser_points() {
  std::vector<LandmarkPoint> all;
  for (int i = 0; i < 8; ++i) {
    const double angle = 0.785 * i + 0.3 * std::sin(5.0 * i);
    all.push_back({i + 1, {(2.5 + 0.2 * i) * std::cos(angle), (3 - 0.15 * i) * std::sin(angle)}});
  }
  return all;
}

/// A simulated robot that drives in circles and measures ranges and bearings.
struct LaserRobot {
  SE2 truth{0, -1, 0};
  SE2 odom{};
  double seconds = 10;
  double laser_x_m = 0;
  Random random{3};
  std::size_t in_view = 8;  ///< points 1 to in_view are observed

  void drive(RiekfLocalizer& filter, double duration_s, bool sees = true) {
    for (int i = 0; i < std::lround(duration_s * 50); ++i) {
      const Eigen::Vector3d u(0.006, 0, 0.006);
      truth = truth * SE2::exp(u);
      odom = odom * SE2::exp({u.x() + 2e-4 * random.normal(), 0, u.z() + 2e-4 * random.normal()});
      seconds += 0.02;
      filter.add(Odometry{.stamp = laser_time(seconds), .odom_T_base = odom});
      if (i % 5 == 0 && sees) observe(filter);
      filter.clear_comparisons();
    }
  }

 private:
  void observe(RiekfLocalizer& filter) {
    for (const LandmarkPoint& point : laser_points()) {
      if (static_cast<std::size_t>(point.number) > in_view) continue;
      const Eigen::Vector2d p = (truth * SE2(laser_x_m, 0, 0)).inverse() * point.map_p;
      filter.add(RangeBearing{laser_time(seconds), point.number, p.norm() + 0.03 * random.normal(),
                              std::atan2(p.y(), p.x()) + 0.026 * random.normal()});
    }
  }
};

inline RiekfLocalizer laser_filter(const RiekfOptions& options = {}) {
  return {Landmarks::of_points(laser_points()).value(), MountedSensor{}, options};
}

inline double off_m(const RiekfLocalizer& filter, const LaserRobot& robot) {
  return (filter.estimate()->map_T_base.translation() - robot.truth.translation()).norm();
}

/// The findings of the filter, one per line.
inline std::string findings(const RiekfLocalizer& filter) {
  std::string lines;
  for (const std::string& problem : filter.problems()) lines += problem + "\n";
  return lines;
}

}  // namespace waymark::test

#include "waymark/plot/run_figures.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "waymark/base/angles.hpp"
#include "waymark/evaluation/pose_pairs.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/plot/loop_figures.hpp"

namespace waymark::plot {
namespace {

constexpr Duration kMaxGap = std::chrono::milliseconds(500);

Figure over_time(const std::string& title, Axis y, std::vector<Series> series) {
  return {.title = title,
          .x = {.label = "time", .unit = "s"},
          .y = std::move(y),
          .series = std::move(series),
          .height_mm = 65};
}

/// Twice the standard deviation in the direction of the floor in which it is largest.
double two_sigma_m(const Eigen::Matrix3d& covariance) {
  return 2 * std::sqrt(std::max(0.0, symmetric_eigenvalues<2>(covariance.topLeftCorner<2, 2>())[1]));
}

}  // namespace

Figure speed_figure(const std::string& title, const std::vector<Odometry>& odometry) {
  Series speed{.name = "speed [m/s]", .color = kTaughtColor};
  Series turn{.name = "yaw rate [rad/s]", .color = kEstimateColor};
  for (const Odometry& sample : odometry) {
    const double t = to_seconds(sample.stamp - odometry.front().stamp);
    speed.x.push_back(t);
    turn.x.push_back(t);
    speed.y.push_back(sample.speed_m_s);
    turn.y.push_back(sample.yaw_rate_rad_s);
  }
  return over_time(title, {.label = "by the wheels", .unit = ""}, {std::move(speed), std::move(turn)});
}

Figure error_and_doubt_figure(const std::string& title, const EstimatedTrajectory& estimate,
                              const Trajectory& truth) {
  Series error{.name = "distance from the truth", .color = kEstimateColor};
  Series doubt{.name = "twice the standard deviation claimed", .color = kPalette[3]};
  for (const PosePair& pair : pair_by_time(estimate, truth, kMaxGap)) {
    error.x.push_back(to_seconds(pair.estimated.stamp - estimate.front().stamp));
    error.y.push_back(
        (pair.estimated.map_T_base.translation() - pair.reference.translation()).head<2>().norm());
  }
  for (const EstimatedPose& pose : estimate) {
    doubt.x.push_back(to_seconds(pose.stamp - estimate.front().stamp));
    doubt.y.push_back(pose.covariance ? two_sigma_m(*pose.covariance)
                                      : std::numeric_limits<double>::quiet_NaN());
  }
  std::vector<Series> series;
  if (!error.x.empty()) series.push_back(std::move(error));
  series.push_back(std::move(doubt));
  return over_time(title, {.label = "position", .unit = "m", .low = 0}, std::move(series));
}

Figure heading_error_figure(const std::string& title, const EstimatedTrajectory& estimate,
                            const Trajectory& truth) {
  Series error{.name = "", .color = kEstimateColor};
  for (const PosePair& pair : pair_by_time(estimate, truth, kMaxGap)) {
    const SE3 truth_T_estimate = pair.reference.inverse() * pair.estimated.map_T_base;
    error.x.push_back(to_seconds(pair.estimated.stamp - estimate.front().stamp));
    error.y.push_back(to_degrees(project_to_plane(truth_T_estimate).yaw()));
  }
  return over_time(title, {.label = "heading", .unit = "deg"}, {std::move(error)});
}

}  // namespace waymark::plot

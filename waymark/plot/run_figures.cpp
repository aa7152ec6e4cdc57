#include "waymark/plot/run_figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "waymark/base/angles.hpp"
#include "waymark/evaluation/driven_path.hpp"
#include "waymark/evaluation/pose_pairs.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark::plot {
namespace {

constexpr double kStepMetres = 0.02;
constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

void add_point(Series& series, const Eigen::Vector3d& p) {
  series.x.push_back(p.x());
  series.y.push_back(p.y());
}

void add_gap(Series& series) {
  series.x.push_back(kGap);
  series.y.push_back(kGap);
}

/// Line style of the layer at `index`. Earlier layers are wider, so they remain visible under later ones.
LineStyle line_of(std::size_t index) {
  const std::array<LineStyle, 4> styles = {LineStyle{.width_mm = 1.1},
                                           {.width_mm = 0.55, .dash_mm = {2.4, 1.2}},
                                           {.width_mm = 0.35, .dash_mm = {0.7, 0.7}},
                                           {.width_mm = 0.25}};
  return styles.at(std::min(index, styles.size() - 1));
}

Series path_series(const PathLayer& layer, std::size_t index) {
  Series series{.name = layer.name, .color = layer.color, .line = line_of(index)};
  for (const StampedPose& pose : layer.path) add_point(series, pose.map_T_base.translation());
  return series;
}

/// Each tag seen from above: its side, and a stroke of half its length towards the viewer. `labelled`
/// contains the tags that already have an id next to them.
Series tag_series(const PathLayer& layer, std::size_t index, std::set<TagId>& labelled) {
  Series series{.name = layer.path.empty() ? layer.name : "",
                .color = layer.color,
                .line = line_of(std::max<std::size_t>(index, 1))};
  series.line->dash_mm.clear();
  for (const auto& [tag, mapped] : layer.tags.tags) {
    const double half = mapped.size_m / 2;
    const auto corner = [&](double x, double z) { return mapped.map_T_tag * Eigen::Vector3d(x, 0, z); };
    for (const Eigen::Vector3d& p : {corner(-half, 0), corner(half, 0), corner(0, 0), corner(0, -half)})
      add_point(series, p);
    add_gap(series);
    if (!labelled.insert(tag).second) continue;
    const Eigen::Vector3d behind = corner(0, 0.9 * mapped.size_m + 0.05);
    series.labels.push_back({behind.x(), behind.y(), std::to_string(tag.number)});
  }
  return series;
}

/// Position of the base interpolated between two poses.
std::optional<Eigen::Vector3d> position_at(const Trajectory& trajectory, SensorTime stamp) {
  const auto after = std::ranges::lower_bound(trajectory, stamp, {}, &StampedPose::stamp);
  if (after == trajectory.end()) return std::nullopt;
  if (after->stamp == stamp) return after->map_T_base.translation();
  if (after == trajectory.begin()) return std::nullopt;
  const auto before = after - 1;
  const double u = to_seconds(stamp - before->stamp) / to_seconds(after->stamp - before->stamp);
  return (1 - u) * before->map_T_base.translation() + u * after->map_T_base.translation();
}

Figure over_distance(const std::string& title, const std::string& what, Series series) {
  return {.title = title,
          .x = {.label = "distance driven", .unit = "m"},
          .y = {.label = what, .unit = "m", .low = 0},
          .series = {std::move(series)},
          .height_mm = 70};
}

}  // namespace

Figure path_figure(const std::string& title, const std::vector<PathLayer>& layers) {
  Figure figure{.title = title,
                .x = {.label = "x", .unit = "m"},
                .y = {.label = "y", .unit = "m"},
                .equal_scales = true,
                .height_mm = 140};
  std::set<TagId> labelled;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    if (!layers[i].path.empty()) figure.series.push_back(path_series(layers[i], i));
    if (!layers[i].tags.tags.empty()) figure.series.push_back(tag_series(layers[i], i, labelled));
  }
  return figure;
}

Figure trajectory_error_figure(const std::string& title, const Trajectory& estimated,
                               const Trajectory& truth) {
  Series series{.name = "", .color = kEstimateColor};
  double driven_m = 0;
  std::optional<Eigen::Vector3d> last;
  for (const StampedPose& pose : estimated) {
    const auto position = position_at(truth, pose.stamp);
    if (!position) continue;
    driven_m += last ? (*position - *last).norm() : 0;
    last = position;
    series.x.push_back(driven_m);
    series.y.push_back((pose.map_T_base.translation() - *position).norm());
  }
  return over_distance(title, "position error", std::move(series));
}

Figure cross_track_figure(const std::string& title, const Trajectory& driven, const Trajectory& taught) {
  Series series{.name = "", .color = kEstimateColor};
  const auto reference = internal::driven_path(taught, kStepMetres);
  for (const internal::PathPose& at : internal::driven_path(driven, kStepMetres)) {
    const auto foot = internal::nearest_foot(reference, at);
    series.x.push_back(at.arc_length_m);
    series.y.push_back(foot ? foot->distance_m : kGap);
  }
  return over_distance(title, "cross-track error", std::move(series));
}

Figure tags_in_view_figure(const std::string& title, const std::vector<TagFrame>& frames) {
  Series series{.name = "", .color = kTaughtColor};
  for (const TagFrame& frame : frames) {
    series.x.push_back(to_seconds(frame.stamp.time_since_epoch()));
    series.y.push_back(static_cast<double>(frame.detections.size()));
  }
  return {.title = title,
          .x = {.label = "time", .unit = "s"},
          .y = {.label = "tags in view", .unit = "", .low = 0},
          .series = {std::move(series)},
          .height_mm = 60};
}

namespace {

constexpr Duration kMaxGap = std::chrono::milliseconds(500);

Figure over_time(const std::string& title, Axis y, std::vector<Series> series) {
  return {.title = title,
          .x = {.label = "time", .unit = "s"},
          .y = std::move(y),
          .series = std::move(series),
          .height_mm = 65};
}

/// Twice the standard deviation in the floor-plane direction in which it is largest.
double two_sigma_m(const Eigen::Matrix3d& covariance) {
  return 2 * std::sqrt(std::max(0.0, symmetric_eigenvalues<2>(covariance.topLeftCorner<2, 2>())[1]));
}

}  // namespace

Figure speed_figure(const std::string& title, const std::vector<Odometry>& odometry) {
  Series speed{.name = "speed [m/s]", .color = kOdometryColor};
  Series turn{.name = "yaw rate [rad/s]", .color = kEstimateColor};
  for (const Odometry& sample : odometry) {
    const double t = to_seconds(sample.stamp - odometry.front().stamp);
    speed.x.push_back(t);
    turn.x.push_back(t);
    speed.y.push_back(sample.speed_m_s);
    turn.y.push_back(sample.yaw_rate_rad_s);
  }
  return over_time(title, {.label = "wheel odometry", .unit = ""}, {std::move(speed), std::move(turn)});
}

Figure error_and_uncertainty_figure(const std::string& title, const EstimatedTrajectory& estimate,
                                    const Trajectory& truth) {
  Series error{.name = "position error", .color = kEstimateColor};
  Series deviation{.name = "2 sigma of the estimate", .color = kPalette[3]};
  for (const PosePair& pair : pair_by_time(estimate, truth, kMaxGap)) {
    error.x.push_back(to_seconds(pair.estimated.stamp - estimate.front().stamp));
    error.y.push_back(
        (pair.estimated.map_T_base.translation() - pair.reference.translation()).head<2>().norm());
  }
  for (const EstimatedPose& pose : estimate) {
    deviation.x.push_back(to_seconds(pose.stamp - estimate.front().stamp));
    deviation.y.push_back(pose.covariance ? two_sigma_m(*pose.covariance)
                                          : std::numeric_limits<double>::quiet_NaN());
  }
  std::vector<Series> series;
  if (!error.x.empty()) series.push_back(std::move(error));
  series.push_back(std::move(deviation));
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

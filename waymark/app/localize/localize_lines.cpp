#include "waymark/app/localize/localize_lines.hpp"

#include <cmath>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/geometry/dense.hpp"

namespace waymark {
namespace {

/// The standard deviation of the position in the worst direction [m].
double position_sigma_m(const Uncertain<SE3>& pose) {
  const Eigen::Matrix3d position = coordinate_covariance(pose).topLeftCorner<3, 3>();
  return std::sqrt(symmetric_eigen<3>(position).values.maxCoeff());
}

/// A pose in six degrees of freedom, to be written as JSON.
struct BodyPose {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  double sigma_m = 0;
};

ReportFields fields(const BodyPose& pose) {
  return {{"position_m", "Position of the camera in the map: x, y, z", pose.position_m},
          {"rotation_xyzw", "Orientation of the camera body (x forward, y left, z up) in the map",
           pose.rotation.coeffs()},
          {"position_sigma_m", "Largest standard deviation of the position", pose.sigma_m}};
}

}  // namespace

std::string estimate_line(double since_s, const std::optional<LocalizationEstimate>& estimate) {
  if (!estimate)
    return fmt::format("{:8.1f} s: unknown: no map tags observed, or no data from the robot\n", since_s);
  const SE2& pose = estimate->map_T_base;
  return fmt::format(
      "{:8.1f} s: x {:.3f} m, y {:.3f} m, heading {:.1f} deg, within {:.3f} m and {:.2f} deg{}\n", since_s,
      pose.x(), pose.y(), to_degrees(pose.yaw()), estimate->position_sigma_m(),
      to_degrees(std::sqrt(estimate->covariance(2, 2))), estimate->certain ? "" : ", uncertain");
}

ReportFields fields(const LocalizationEstimate& estimate) {
  const SE2& pose = estimate.map_T_base;
  return {{"stamp_s", "Time of the estimate", to_seconds(estimate.stamp.time_since_epoch())},
          {"x_m", "Position along the x axis of the map", pose.x()},
          {"y_m", "Position along the y axis of the map", pose.y()},
          {"yaw_rad", "Heading", pose.yaw()},
          {"position_sigma_m", "Largest standard deviation of the position", estimate.position_sigma_m()},
          {"yaw_sigma_rad", "Standard deviation of the heading", std::sqrt(estimate.covariance(2, 2))},
          {"certain", "Whether the estimate is certain", estimate.certain}};
}

ReportFields fields(const EstimateMoment& moment) {
  return {{"now_s", "Time of the line on the robot's clock", to_seconds(moment.now.time_since_epoch())},
          {"pose", "Pose of the robot", moment.estimate}};
}

std::string moment_line(double since_s, const CameraMoment& moment) {
  if (!moment.map_T_body)
    return fmt::format("{:8.1f} s: unknown, {}\n", since_s,
                       moment.tags == 0 ? "no tags detected" : moment.why);
  const SE3& pose = moment.map_T_body->mean;
  const Eigen::Vector3d& at = pose.translation();
  const Eigen::Vector3d rpy = pose.rotation().rpy();
  return fmt::format(
      "{:8.1f} s: x {:.3f} m, y {:.3f} m, z {:.3f} m, roll {:.1f} deg, pitch {:.1f} deg, yaw {:.1f} deg, "
      "within {:.3f} m, from {} tags\n",
      since_s, at.x(), at.y(), at.z(), to_degrees(rpy.x()), to_degrees(rpy.y()), to_degrees(rpy.z()),
      position_sigma_m(*moment.map_T_body), moment.tags);
}

ReportFields fields(const CameraMoment& moment) {
  const auto pose = part(moment.map_T_body, [](const Uncertain<SE3>& body) {
    return BodyPose{body.mean.translation(), body.mean.rotation().quaternion(), position_sigma_m(body)};
  });
  return {{"stamp_s", "Time of the image: since 1970, or since the first image of a video",
           to_seconds(moment.stamp.time_since_epoch())},
          {"age_ms", "Age of the image when it was used; 0 for a video", 1e3 * to_seconds(moment.age)},
          {"tags", "Map tags used for the pose; without a pose: detected tags", moment.tags},
          {"pose", "Pose of the camera", pose},
          {"why", "If there is no pose: the reason; empty if no tags were detected",
           if_any(pose ? std::nullopt : std::optional(std::string(moment.why)))}};
}

void EstimateLines::take(SensorTime now, const std::optional<LocalizationEstimate>& estimate) {
  if (!first_) first_ = now;
  print_(json_ ? json_line(fields(EstimateMoment{now, estimate}))
               : estimate_line(to_seconds(now - *first_), estimate));
}

void MomentLines::take(const CameraMoment& moment) {
  if (!first_) first_ = next_ = moment.stamp;
  if (moment.stamp < next_) return;
  next_ = moment.stamp + every_;
  print_(json_ ? json_line(fields(moment)) : moment_line(to_seconds(moment.stamp - *first_), moment));
}

}  // namespace waymark

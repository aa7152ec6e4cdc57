#include "waymark/app/localize/localize_lines.hpp"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/geometry/dense.hpp"

namespace waymark {
namespace {

/// The largest standard deviation of the position [m].
double position_sigma_m(const Uncertain<SE3>& pose) {
  const Eigen::Matrix3d position = coordinate_covariance(pose).topLeftCorner<3, 3>();
  return std::sqrt(symmetric_eigen<3>(position).values.maxCoeff());
}

}  // namespace

std::string estimate_line(double since_s, const std::optional<LocalizationEstimate>& estimate) {
  if (!estimate)
    return fmt::format("{:8.1f} s: not known: no tags of the map were seen, or the robot is silent\n",
                       since_s);
  const SE2& pose = estimate->map_T_base;
  return fmt::format(
      "{:8.1f} s: x {:.3f} m, y {:.3f} m, heading {:.1f} deg, within {:.3f} m and {:.2f} deg{}\n", since_s,
      pose.x(), pose.y(), to_degrees(pose.yaw()), estimate->position_sigma_m(),
      to_degrees(std::sqrt(estimate->covariance(2, 2))), estimate->certain ? "" : ", a guess");
}

std::string estimate_json(SensorTime now, const std::optional<LocalizationEstimate>& estimate) {
  nlohmann::ordered_json json{{"now_s", to_seconds(now.time_since_epoch())}, {"pose", nullptr}};
  if (!estimate) return json_line(json);
  const SE2& pose = estimate->map_T_base;
  json["pose"] = {{"stamp_s", to_seconds(estimate->stamp.time_since_epoch())},
                  {"x_m", pose.x()},
                  {"y_m", pose.y()},
                  {"yaw_rad", pose.yaw()},
                  {"position_sigma_m", estimate->position_sigma_m()},
                  {"yaw_sigma_rad", std::sqrt(estimate->covariance(2, 2))},
                  {"certain", estimate->certain}};
  return json_line(json);
}

std::string moment_line(double since_s, const CameraMoment& moment) {
  if (!moment.map_T_body)
    return fmt::format("{:8.1f} s: not known, {}\n", since_s,
                       moment.tags == 0 ? "no tags were seen" : moment.why);
  const SE3& pose = moment.map_T_body->mean;
  const Eigen::Vector3d& at = pose.translation();
  const Eigen::Vector3d rpy = pose.rotation().rpy();
  return fmt::format(
      "{:8.1f} s: x {:.3f} m, y {:.3f} m, z {:.3f} m, roll {:.1f} deg, pitch {:.1f} deg, yaw {:.1f} deg, "
      "within {:.3f} m by {} tags\n",
      since_s, at.x(), at.y(), at.z(), to_degrees(rpy.x()), to_degrees(rpy.y()), to_degrees(rpy.z()),
      position_sigma_m(*moment.map_T_body), moment.tags);
}

std::string moment_json(const CameraMoment& moment) {
  nlohmann::ordered_json json{{"stamp_s", to_seconds(moment.stamp.time_since_epoch())},
                              {"age_ms", 1e3 * to_seconds(moment.age)},
                              {"tags", moment.tags},
                              {"pose", nullptr}};
  if (!moment.map_T_body) {
    json["why"] = moment.why;
    return json_line(json);
  }
  const Eigen::Vector3d& at = moment.map_T_body->mean.translation();
  const Eigen::Quaterniond& q = moment.map_T_body->mean.rotation().quaternion();
  json["pose"] = {{"position_m", {at.x(), at.y(), at.z()}},
                  {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}},
                  {"position_sigma_m", position_sigma_m(*moment.map_T_body)}};
  return json_line(json);
}

void EstimateLines::take(SensorTime now, const std::optional<LocalizationEstimate>& estimate) {
  if (!first_) first_ = now;
  print_(json_ ? estimate_json(now, estimate) : estimate_line(to_seconds(now - *first_), estimate));
}

void MomentLines::take(const CameraMoment& moment) {
  if (!first_) first_ = next_ = moment.stamp;
  if (moment.stamp < next_) return;
  next_ = moment.stamp + every_;
  print_(json_ ? moment_json(moment) : moment_line(to_seconds(moment.stamp - *first_), moment));
}

}  // namespace waymark

#include "waymark/runtime/commission_readings.hpp"

#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "waymark/base/order_statistics.hpp"

namespace waymark {
namespace {

double seconds_between(SensorTime from, SensorTime to) { return to_seconds(to - from); }

/// First and last sample of a list with some time between them.
template <class T>
bool spans(const std::vector<T>& samples) {
  return samples.size() >= 2 && samples.back().stamp > samples.front().stamp;
}

template <class T, class Value>
double median_of(const std::vector<T>& samples, const Value& value) {
  std::vector<double> values;
  values.reserve(samples.size());
  for (const T& sample : samples) values.push_back(std::invoke(value, sample));
  return median(std::move(values));
}

/// The tag that was in view for the longest time, where it was seen first and last.
std::optional<std::pair<TagPlace, TagPlace>> longest_view(const std::vector<TagPlace>& places) {
  std::map<TagId, std::pair<TagPlace, TagPlace>> views;
  for (const TagPlace& place : places)
    views.try_emplace(place.tag, place, place).first->second.second = place;
  std::optional<std::pair<TagPlace, TagPlace>> longest;
  for (const auto& [tag, view] : views) {
    const bool longer =
        !longest || view.second.stamp - view.first.stamp > longest->second.stamp - longest->first.stamp;
    if (longer) longest = view;
  }
  constexpr double kLeast_s = 0.3;
  if (longest && seconds_between(longest->first.stamp, longest->second.stamp) < kLeast_s) return std::nullopt;
  return longest;
}

/// Sum of the steps, each less than half a turn.
double turned_rad(const std::vector<Odometry>& odometry) {
  double sum = 0;
  for (std::size_t i = 1; i < odometry.size(); ++i)
    sum += (odometry[i - 1].odom_T_base.inverse() * odometry[i].odom_T_base).yaw();
  return sum;
}

/// The way where yaw points; of one that goes elsewhere (judge_axes() says so) its length.
double ahead_m(const OdometryLeg& leg) {
  const double ahead = leg.moved_m.dot(Eigen::Vector2d(std::cos(leg.yaw_rad), std::sin(leg.yaw_rad)));
  const double length = leg.moved_m.norm();
  return std::abs(ahead) > length / 2 ? std::copysign(length, ahead) : length;
}

double bearing_rad(const TagPlace& place) {
  return std::atan2(place.base_p_tag_m.y(), place.base_p_tag_m.x());
}

Eigen::Vector3d mean_rotation(const std::vector<ImuSample>& imu) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : imu) sum += sample.angular_velocity_rad_s;
  return imu.empty() ? sum : Eigen::Vector3d(sum / static_cast<double>(imu.size()));
}

}  // namespace

std::optional<Eigen::Vector3d> rotation_by_gyro(const MotionTrace& steady, const MotionTrace& standing) {
  if (steady.imu.size() < 2) return std::nullopt;
  return mean_rotation(steady.imu) - mean_rotation(standing.imu);
}

std::optional<Eigen::Vector2d> wheel_rates(const MotionTrace& steady) {
  if (!spans(steady.wheels)) return std::nullopt;
  const WheelTicks& first = steady.wheels.front();
  const WheelTicks& last = steady.wheels.back();
  return Eigen::Vector2d(last.left_rad - first.left_rad, last.right_rad - first.right_rad) /
         seconds_between(first.stamp, last.stamp);
}

std::optional<OdometryLeg> odometry_leg(const MotionTrace& steady) {
  if (!spans(steady.odometry)) return std::nullopt;
  const std::vector<Odometry>& all = steady.odometry;
  return OdometryLeg{.yaw_rad = all[all.size() / 2].odom_T_base.yaw(),
                     .moved_m = all.back().odom_T_base.translation() - all.front().odom_T_base.translation()};
}

std::vector<MotionReading> forward_readings(const MotionTrace& steady, const RobotModel& model) {
  std::vector<MotionReading> readings;
  const double asked = steady.commanded.speed_m_s;
  const auto add = [&](std::string key, std::string origin, double measured) {
    readings.push_back({std::move(key), std::move(origin), ReadingUnit::Length, measured, measured / asked});
  };
  if (spans(steady.odometry)) {
    const double took_s = seconds_between(steady.odometry.front().stamp, steady.odometry.back().stamp);
    add("odometry.speed_m_s", "odometry", median_of(steady.odometry, &Odometry::speed_m_s));
    add("odometry.position", "odometry", ahead_m(*odometry_leg(steady)) / took_s);
  }
  if (const auto wheels = wheel_rates(steady)) {
    const double rate_rad_s = wheels->mean();
    add("wheels", "wheels", rate_rad_s * model.wheel_radius_m);
    readings.back().unit = ReadingUnit::Angle;
  }
  if (const auto view = longest_view(steady.tags)) {
    const double nearer_m = view->first.base_p_tag_m.x() - view->second.base_p_tag_m.x();
    add("camera_mounting", "tags", nearer_m / seconds_between(view->first.stamp, view->second.stamp));
  }
  return readings;
}

std::vector<MotionReading> turn_readings(const MotionTrace& steady, const MotionTrace& standing,
                                         const RobotModel& model) {
  std::vector<MotionReading> readings;
  const double asked = steady.commanded.yaw_rate_rad_s;
  const auto add = [&](std::string key, std::string origin, double measured) {
    readings.push_back({std::move(key), std::move(origin), ReadingUnit::Angle, measured, measured / asked});
  };
  if (spans(steady.odometry)) {
    const double took_s = seconds_between(steady.odometry.front().stamp, steady.odometry.back().stamp);
    add("odometry.yaw_rate_rad_s", "odometry", median_of(steady.odometry, &Odometry::yaw_rate_rad_s));
    add("odometry.yaw_rad", "odometry", turned_rad(steady.odometry) / took_s);
  }
  if (const auto wheels = wheel_rates(steady))
    add("wheels", "wheels", (wheels->y() - wheels->x()) * model.wheel_radius_m / model.track_m);
  if (const auto gyro = rotation_by_gyro(steady, standing))
    add("imu.angular_velocity_rad_s", "imu", gyro->z());
  if (const auto view = longest_view(steady.tags)) {
    const double to_the_right =
        std::remainder(bearing_rad(view->first) - bearing_rad(view->second), 2 * M_PI);
    add("camera_mounting", "tags", to_the_right / seconds_between(view->first.stamp, view->second.stamp));
  }
  return readings;
}

}  // namespace waymark

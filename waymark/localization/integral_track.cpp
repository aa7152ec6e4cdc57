#include "waymark/localization/integral_track.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "waymark/base/order_statistics.hpp"
#include "waymark/samples/odometry_jump.hpp"

namespace waymark {
namespace {

constexpr double kMaxGyroInterval_s = 0.2;
constexpr double kMaxOdometryInterval_s = 0.5;

double seconds_since(SensorTime epoch, SensorTime stamp) { return to_seconds(stamp - epoch); }

bool is_finite(const Odometry& sample) { return sample.odom_T_base.matrix().allFinite(); }

/// Distance of a typical step; with odometry in centimetres, it exceeds that of any robot.
double typical_step_m(const std::vector<Odometry>& samples) {
  std::vector<double> steps_m;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double step_m =
        (samples[i].odom_T_base.translation() - samples[i - 1].odom_T_base.translation()).norm();
    if (std::isfinite(step_m) && step_m > 0) steps_m.push_back(step_m);
  }
  return median(std::move(steps_m));
}

}  // namespace

void IntegralTrack::add(double time_s, const Eigen::Vector3d& step, bool gap) {
  Point next{.time_s = time_s};
  if (!points_.empty()) {
    next.integral = points_.back().integral;
    if (!gap) next.integral += step;
    next.gaps = points_.back().gaps + (gap ? 1 : 0);
  }
  points_.push_back(next);
}

IntegralTrack IntegralTrack::of_gyro(const std::vector<ImuSample>& samples, SensorTime epoch) {
  IntegralTrack track;
  const ImuSample* before = nullptr;
  for (const ImuSample& sample : samples) {
    if (!sample.angular_velocity_rad_s.allFinite()) continue;
    if (before != nullptr && sample.stamp <= before->stamp) continue;
    const double dt_s = before != nullptr ? to_seconds(sample.stamp - before->stamp) : 0;
    const Eigen::Vector3d step =
        before != nullptr
            ? Eigen::Vector3d(dt_s / 2 * (before->angular_velocity_rad_s + sample.angular_velocity_rad_s))
            : Eigen::Vector3d::Zero();
    track.add(seconds_since(epoch, sample.stamp), step, dt_s > kMaxGyroInterval_s);
    before = &sample;
  }
  return track;
}

IntegralTrack IntegralTrack::of_odometry(const std::vector<Odometry>& samples, SensorTime epoch) {
  constexpr double kMaxStepRatio = 10;
  const double max_step_m = kMaxStepRatio * typical_step_m(samples);
  IntegralTrack track;
  const Odometry* before = nullptr;
  for (const Odometry& sample : samples) {
    if (!is_finite(sample)) continue;
    if (before != nullptr && sample.stamp <= before->stamp) continue;
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    bool gap = false;
    if (before != nullptr) {
      const SE2::Tangent twist = (before->odom_T_base.inverse() * sample.odom_T_base).log();
      const double path_m = twist.head<2>().norm();
      step = {twist.x(), twist.z(), path_m};
      gap = to_seconds(sample.stamp - before->stamp) > kMaxOdometryInterval_s ||
            (odometry_jumped(*before, sample) && path_m > max_step_m);
    }
    track.add(seconds_since(epoch, sample.stamp), step, gap);
    before = &sample;
  }
  return track;
}

std::optional<IntegralTrack::Point> IntegralTrack::at(double time_s) const {
  const auto after = std::ranges::lower_bound(points_, time_s, {}, &Point::time_s);
  if (after == points_.end()) return std::nullopt;
  if (after->time_s == time_s) return *after;
  if (after == points_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  if (after->gaps != before->gaps) return std::nullopt;
  const double share = (time_s - before->time_s) / (after->time_s - before->time_s);
  return Point{time_s, before->integral + share * (after->integral - before->integral), before->gaps};
}

std::optional<Eigen::Vector3d> IntegralTrack::change(double from_s, double to_s) const {
  const auto a = at(from_s);
  const auto b = at(to_s);
  if (!a || !b || a->gaps != b->gaps) return std::nullopt;
  return Eigen::Vector3d(b->integral - a->integral);
}

std::optional<Eigen::Vector3d> IntegralTrack::rate(double at_s) const {
  constexpr double kHalf_s = 0.05;
  const auto moved = change(at_s - kHalf_s, at_s + kHalf_s);
  if (!moved) return std::nullopt;
  return Eigen::Vector3d(*moved / (2 * kHalf_s));
}

}  // namespace waymark

#include "waymark/evaluation/dead_reckoning.hpp"

#include <algorithm>

#include "waymark/evaluation/pose_pairs.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

/// The angle turned since the first gyro sample, at any time covered by the samples.
class GyroAngle {
 public:
  explicit GyroAngle(const std::vector<ImuSample>& imu) : imu_(imu) {}

  /// Times must not decrease between calls.
  double at(SensorTime stamp) {
    while (next_ + 1 < imu_.size() && imu_[next_ + 1].stamp <= stamp) {
      angle_rad_ += turned_until(imu_[next_ + 1].stamp);
      ++next_;
    }
    return angle_rad_ + turned_until(stamp);
  }

 private:
  [[nodiscard]] double turned_until(SensorTime stamp) const {
    return imu_[next_].angular_velocity_rad_s.z() * to_seconds(stamp - imu_[next_].stamp);
  }

  const std::vector<ImuSample>& imu_;
  std::size_t next_ = 0;
  double angle_rad_ = 0;
};

}  // namespace

Trajectory wheel_odometry(const std::vector<Odometry>& odometry) {
  Trajectory trajectory;
  for (const Odometry& sample : odometry) trajectory.push_back({sample.stamp, lift(sample.odom_T_base)});
  return trajectory;
}

Trajectory gyro_odometry(const std::vector<Odometry>& odometry, const std::vector<ImuSample>& imu) {
  Trajectory trajectory;
  if (imu.empty()) return trajectory;
  GyroAngle gyro(imu);
  const Odometry* before = nullptr;
  double angle_before = 0;
  SE2 odom_T_base;
  for (const Odometry& now : odometry) {
    if (now.stamp < imu.front().stamp || now.stamp > imu.back().stamp) continue;
    const double angle = gyro.at(now.stamp);
    if (before != nullptr) {
      SE2::Tangent motion = (before->odom_T_base.inverse() * now.odom_T_base).log();
      motion.z() = angle - angle_before;
      odom_T_base = odom_T_base * SE2::exp(motion);
    }
    trajectory.push_back({now.stamp, lift(odom_T_base)});
    before = &now;
    angle_before = angle;
  }
  return trajectory;
}

EstimatedTrajectory placed_at(const Trajectory& trajectory, const StampedPose& start) {
  const auto there = pose_at(trajectory, start.stamp, Duration::max());
  EstimatedTrajectory placed;
  if (!there) return placed;
  const SE3 map_T_odom = start.map_T_base * there->inverse();
  for (const StampedPose& pose : trajectory)
    if (pose.stamp >= start.stamp) placed.push_back({pose.stamp, map_T_odom * pose.map_T_base, {}});
  return placed;
}

}  // namespace waymark

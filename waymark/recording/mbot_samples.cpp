#include "waymark/recording/mbot_samples.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Geometry>

namespace waymark::mbot {
namespace {

constexpr double kTicksPerTurn = 3120;
constexpr std::int64_t kNanosecondsPerMicrosecond = 1000;

Error words(std::string message, std::string_view channel, std::string hint = {}) {
  return {ErrorCode::Unsupported, std::move(message), {.key = std::string(channel)}, std::move(hint)};
}

template <class Array>
Eigen::Vector3d vector(const Array& v) {
  return {double{v[0]}, double{v[1]}, double{v[2]}};
}

}  // namespace

Status Samples::add(std::string_view channel, std::int64_t receive_us, ByteSpan payload) {
  switch (fingerprint_of(payload)) {
    case kPose2D:
      return on_pose(channel, receive_us, payload);
    case kTwist2D:
      return on_twist(channel, receive_us, payload);
    case kEncoders:
      return on_encoders(channel, receive_us, payload);
    case kImu:
      return on_imu(channel, receive_us, payload);
    case kTagArray:
      return on_tags(channel, receive_us, payload);
    case kLidar:
      return on_lidar(channel, receive_us, payload);
    default:
      return {};
  }
}

Status Samples::finish() {
  if (!odometry_) return {};
  const Sample sample = *odometry_;
  odometry_.reset();
  return visit_(sample);
}

Status Samples::undecodable(std::string_view channel) {
  problems_.damage(fmt::format("mbot.undecodable:{}", channel), [&] {
    return Error{ErrorCode::Unreadable,
                 "a message of another length than its type has: passed over",
                 {.key = std::string(channel)},
                 {}};
  });
  return {};
}

SensorTime Samples::stamp(std::int64_t utime, std::int64_t receive_us) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max() / kNanosecondsPerMicrosecond;
  if (utime <= 0 || utime > kMost)
    utime = std::clamp<std::int64_t>(receive_us, 0, kMost);  // the log notes it
  return SensorTime(Duration(utime * kNanosecondsPerMicrosecond));
}

Status Samples::on_pose(std::string_view channel, std::int64_t receive_us, ByteSpan payload) {
  // Other poses (of SLAM, of goals) are no odometry.
  if (channel.find("ODOM") == std::string_view::npos) return {};
  const auto pose = decode<Pose2D>(payload);
  const bool finite = pose && std::isfinite(pose->x) && std::isfinite(pose->y) && std::isfinite(pose->theta);
  if (!finite) return undecodable(channel);
  if (Status status = finish(); !status) return status;
  odometry_ = Odometry{.stamp = stamp(pose->utime, receive_us),
                       .odom_T_base = SE2(double{pose->x}, double{pose->y}, double{pose->theta})};
  return {};
}

Status Samples::on_twist(std::string_view channel, std::int64_t receive_us, ByteSpan payload) {
  const auto twist = decode<Twist2D>(payload);
  const bool finite = twist && std::isfinite(twist->vx) && std::isfinite(twist->wz);
  if (!finite) return undecodable(channel);
  if (channel.find("CMD") != std::string_view::npos)
    return visit_(StampedCommand{stamp(twist->utime, receive_us), {double{twist->vx}, double{twist->wz}}});
  const SensorTime measured = stamp(twist->utime, receive_us);
  if (!odometry_ || odometry_->stamp != measured) return {};
  problems_.trap("mbot.mean_speed", [&] {
    return words(
        "a speed is the mean since the message before it; it is joined with the pose of the same utime",
        channel, "Propagate with the new speed over the interval that ends with it.");
  });
  odometry_->speed_m_s = double{twist->vx};
  odometry_->yaw_rate_rad_s = double{twist->wz};
  return finish();
}

Status Samples::on_encoders(std::string_view channel, std::int64_t receive_us, ByteSpan payload) {
  const auto encoders = decode<Encoders>(payload);
  if (!encoders) return undecodable(channel);
  problems_.trap("mbot.encoders", [&] {
    return words(
        "the right encoder counts backwards and a turn is 3120 ticks (not the firmware's 3744): turned into "
        "radians forwards",
        channel);
  });
  constexpr double kRadPerTick = 2 * std::numbers::pi / kTicksPerTurn;
  return visit_(WheelTicks{stamp(encoders->utime, receive_us),
                           kRadPerTick * static_cast<double>(encoders->ticks[0]),
                           -kRadPerTick * static_cast<double>(encoders->ticks[1])});
}

Status Samples::on_imu(std::string_view channel, std::int64_t receive_us, ByteSpan payload) {
  const auto imu = decode<Imu>(payload);
  if (!imu || !vector(imu->gyro).allFinite() || !vector(imu->accel).allFinite()) return undecodable(channel);
  if (conventions_.accelerometer_shows_gravity) {
    problems_.trap("mbot.accelerometer_sign", [&] {
      return words(
          "accel points where gravity pulls: its sign is turned, so that it is specific force (up at rest)",
          channel);
    });
  }
  const double sign = conventions_.accelerometer_shows_gravity ? -1 : 1;
  return visit_(ImuSample{stamp(imu->utime, receive_us), vector(imu->gyro), sign * vector(imu->accel)});
}

Status Samples::on_lidar(std::string_view channel, std::int64_t receive_us, ByteSpan payload) {
  const auto lidar = decode<Lidar>(payload);
  if (!lidar) return undecodable(channel);
  const std::size_t n = lidar->ranges.size();
  if (n < 2) return {};
  LaserScan scan{.stamp = stamp(lidar->utime, receive_us)};
  const auto [low, high] = std::ranges::minmax(lidar->thetas);
  const bool sound = std::isfinite(low) && std::isfinite(high) && high > low;
  if (!sound) return undecodable(channel);
  scan.angle_min_rad = double{low};
  scan.angle_increment_rad = (double{high} - double{low}) / static_cast<double>(n - 1);
  scan.range_min_m = 1e-3;  // 0: nothing came back
  scan.range_max_m = 100;
  scan.ranges_m.assign(n, 0.F);
  for (std::size_t i = 0; i < n; ++i) {
    const double slot = (double{lidar->thetas[i]} - scan.angle_min_rad) / scan.angle_increment_rad;
    if (!std::isfinite(slot)) continue;
    const auto k = std::min(n - 1, static_cast<std::size_t>(std::max(0.0, slot + 0.5)));
    const float range = lidar->ranges[i];
    const bool nearer = range > 0 && (scan.ranges_m[k] <= 0 || range < scan.ranges_m[k]);
    if (nearer) scan.ranges_m[k] = range;
  }
  problems_.trap("mbot.lidar_angles", [&] {
    return words("lidar rays carry angles of their own: each goes to the nearest of evenly spaced directions",
                 channel);
  });
  return visit_(scan);
}

}  // namespace waymark::mbot

#include "waymark/recording/lcm/mbot_samples.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "waymark/base/angles.hpp"

namespace waymark::mbot {
namespace {

constexpr double kTicksPerTurn = 3120;
constexpr std::int64_t kNanosecondsPerMicrosecond = 1000;

Error mbot_error(std::string message, std::string_view channel, std::string hint = {}) {
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
                 "message length does not match its type; skipped",
                 {.key = std::string(channel)},
                 {}};
  });
  return {};
}

SensorTime Samples::stamp(std::int64_t utime, std::int64_t receive_us) {
  constexpr std::int64_t kMaxMicroseconds =
      std::numeric_limits<std::int64_t>::max() / kNanosecondsPerMicrosecond;
  if (utime <= 0 || utime > kMaxMicroseconds)
    utime = std::clamp<std::int64_t>(receive_us, 0, kMaxMicroseconds);  // already noted by the log
  return SensorTime(Duration(utime * kNanosecondsPerMicrosecond));
}

Status Samples::on_pose(std::string_view channel, std::int64_t receive_us, ByteSpan payload) {
  // Other poses (SLAM, goals) are not odometry.
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
    return mbot_error(
        "each speed is the mean since the previous message; it is combined with the pose of the same utime",
        channel, "Propagate with each speed over the interval that ends at its stamp.");
  });
  odometry_->speed_m_s = double{twist->vx};
  odometry_->yaw_rate_rad_s = double{twist->wz};
  return finish();
}

Status Samples::on_encoders(std::string_view channel, std::int64_t receive_us, ByteSpan payload) {
  const auto encoders = decode<Encoders>(payload);
  if (!encoders) return undecodable(channel);
  problems_.trap("mbot.encoders", [&] {
    return mbot_error(
        "the right encoder counts backward and a revolution has 3120 ticks (not 3744 as in the firmware); "
        "converted to "
        "forward radians",
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
      return mbot_error("accel points along gravity; its sign is inverted to specific force (up at rest)",
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
  scan.range_min_m = 1e-3;  // a range of 0 means no return
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
    return mbot_error(
        "lidar rays have individual angles; each is assigned to the nearest of evenly spaced directions",
        channel);
  });
  return visit_(scan);
}

namespace {

constexpr double kMaxTagDistance_m = 20;  ///< maximum distance of a detection, in metres
constexpr std::int32_t kNested = 10;      ///< the tag inside tag k has id 10 k

Eigen::Quaterniond quaternion(const Tag& tag, bool w_first) {
  const std::array<float, 4>& q = tag.angles_quat;
  return w_first ? Eigen::Quaterniond(double{q[0]}, double{q[1]}, double{q[2]}, double{q[3]})
                 : Eigen::Quaterniond(double{q[3]}, double{q[0]}, double{q[1]}, double{q[2]});
}

/// Rotation from roll, pitch and yaw about the fixed axes x, y and z.
Eigen::Quaterniond from_angles(const std::array<float, 3>& rpy, double unit) {
  using Eigen::AngleAxisd;
  return AngleAxisd(double{rpy[2]} * unit, Eigen::Vector3d::UnitZ()) *
         AngleAxisd(double{rpy[1]} * unit, Eigen::Vector3d::UnitY()) *
         AngleAxisd(double{rpy[0]} * unit, Eigen::Vector3d::UnitX());
}

Eigen::Vector3d position(const Tag& tag) {
  return {double{tag.position[0]}, double{tag.position[1]}, double{tag.position[2]}};
}

bool sound(const Tag& tag) {
  const double norm = quaternion(tag, false).norm();
  return position(tag).allFinite() && std::isfinite(norm) && std::abs(norm - 1) < 0.01;
}

Error tag_error(std::string message, std::string hint = {}) {
  return {ErrorCode::Unsupported, std::move(message), {.key = "mbot_apriltag_array_t"}, std::move(hint)};
}

}  // namespace

void Survey::add(ByteSpan payload) {
  const std::uint64_t fingerprint = fingerprint_of(payload);
  if (fingerprint == kTagArray) {
    if (const auto array = decode<TagArray>(payload)) add(*array);
  } else if (fingerprint == kImu) {
    const auto imu = decode<Imu>(payload);
    if (!imu || !std::isfinite(imu->accel[2])) return;
    accel_z_sum_ += double{imu->accel[2]};
    ++imus_;
  }
}

void Survey::add(const TagArray& array) {
  for (const Tag& tag : array.tags) {
    if (!sound(tag)) continue;
    ++tags_;
    if (position(tag).norm() > kMaxTagDistance_m) ++far_tags_;
    for (std::size_t order = 0; order < 2; ++order) {
      const Eigen::Quaterniond q = quaternion(tag, order == 1).normalized();
      const Eigen::Vector3d cam_z_of_tag = q * Eigen::Vector3d::UnitZ();
      if (cam_z_of_tag.dot(position(tag)) < 0) ++turned_away_[order];
      for (std::size_t unit = 0; unit < 2; ++unit) {
        const double dot = q.dot(from_angles(tag.angles_rpy, unit == 1 ? to_radians(1) : 1));
        misfit_[2 * order + unit] += std::isfinite(dot) ? 1 - std::abs(dot) : 1;
      }
    }
  }
}

Conventions Survey::conventions() const {
  const auto best = static_cast<std::size_t>(std::ranges::min_element(misfit_) - misfit_.begin());
  const std::size_t order = best / 2;
  return {.millimetres = 2 * far_tags_ > tags_,
          .quaternion_w_first = order == 1,
          .angles_in_degrees = best % 2 == 1,
          .tag_y_up = 2 * turned_away_.at(order) > tags_,
          .accelerometer_shows_gravity = imus_ > 0 && accel_z_sum_ < 0};
}

void Samples::note_tag_traps(const TagArray& array) {
  const std::uint64_t count = array.tags.size();
  if (camera_latency_.count() != 0) {
    problems_.trap("mbot.publish_stamps", [&] {
      return tag_error(
          fmt::format(
              "tag stamps are publication times; {:.0f} ms are subtracted to obtain the middle of the "
              "exposure",
              to_seconds(camera_latency_) * 1e3),
          "Measure it for other robots and set `tag_latency_s`.");
    });
  }
  if (count == 0) return;
  problems_.trap(
      "mbot.family",
      [] {
        return tag_error(
            "tags have ids but no family; assumed to be tagCustom48h12, the family of MBot tags");
      },
      count);
  if (conventions_.millimetres)
    problems_.trap(
        "mbot.millimetres", [] { return tag_error("tag positions are in millimetres; converted to metres"); },
        count);
  problems_.trap(
      "mbot.quaternion_order",
      [&] {
        return tag_error(fmt::format("quaternion order is {}, as confirmed by angles_rpy in {}",
                                     conventions_.quaternion_w_first ? "w, x, y, z" : "x, y, z, w",
                                     conventions_.angles_in_degrees ? "degrees" : "radians"));
      },
      count);
  if (conventions_.tag_y_up)
    problems_.trap(
        "mbot.tag_frame",
        [] { return tag_error("tag frames have y up and z towards the viewer; rotated about x"); }, count);
  note_nested_tags(array);
}

void Samples::note_nested_tags(const TagArray& array) {
  const auto nested = std::ranges::count_if(array.tags, [&](const Tag& inner) {
    return inner.id != 0 && inner.id % kNested == 0 &&
           std::ranges::any_of(array.tags, [&](const Tag& outer) { return outer.id == inner.id / kNested; });
  });
  if (nested > 0)
    problems_.trap(
        "mbot.nested_tags",
        [] {
          return tag_error(
              "the small tag inside tag k has id 10 k; it is not used as a landmark because it gives the "
              "same pose "
              "with lower accuracy");
        },
        static_cast<std::uint64_t>(nested));
}

std::optional<SeenTagPose> Samples::seen(const Tag& tag) {
  if (!sound(tag)) {
    problems_.damage("mbot.tag_pose",
                     [&] { return tag_error(fmt::format("tag {}: invalid pose; skipped", tag.id)); });
    return std::nullopt;
  }
  SO3 cam_R_tag =
      SO3::from_matrix(quaternion(tag, conventions_.quaternion_w_first).normalized().toRotationMatrix());
  if (conventions_.tag_y_up) cam_R_tag = cam_R_tag * SO3::exp({std::numbers::pi, 0, 0});
  const double unit = conventions_.millimetres ? 1e-3 : 1;
  return SeenTagPose{{FamilyId::TagCustom48h12, tag.id}, SE3(cam_R_tag, unit * position(tag))};
}

Status Samples::on_tags(std::string_view channel, std::int64_t receive_us, ByteSpan payload) {
  const auto array = decode<TagArray>(payload);
  if (!array) return undecodable(channel);
  note_tag_traps(*array);
  TagPoseFrame frame{.stamp = stamp(array->utime, receive_us) - camera_latency_};
  for (const Tag& tag : array->tags) {
    if (auto pose = seen(tag)) frame.tags.push_back(*std::move(pose));
  }
  return visit_(frame);
}

}  // namespace waymark::mbot

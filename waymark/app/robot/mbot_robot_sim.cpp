#include "waymark/app/robot/mbot_robot_sim.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <utility>

#include "waymark/app/robot/plant.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/recording/lcm/mbot_messages.hpp"
#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr Duration kTagLatency = std::chrono::milliseconds(65);
constexpr Duration kTimesyncPeriod = std::chrono::seconds(1);
constexpr double kTicksPerTurn = 3120;

std::int64_t microseconds(Duration duration) {
  return std::chrono::duration_cast<std::chrono::microseconds>(duration).count();
}

std::array<float, 3> floats(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

mbot::Tag tag_of(const TagPoseSolution& pose, int id, MbotGeneration generation) {
  constexpr double kMillimetres = 1000;
  const SO3& cam_R_tag = pose.cam_T_tag.rotation();
  const Eigen::Vector4f q = cam_R_tag.quaternion().coeffs().cast<float>();  // in the order x, y, z, w
  mbot::Tag tag{.id = id, .position = floats(kMillimetres * pose.cam_T_tag.translation())};
  tag.angles_rpy = floats(to_degrees(1) * cam_R_tag.rpy());
  tag.angles_quat = generation == MbotGeneration::Pi5 ? std::array{q[3], q[0], q[1], q[2]}
                                                      : std::array{q[0], q[1], q[2], q[3]};
  return tag;
}

mbot::Lidar lidar_of(const LaserScan& scan, std::int64_t utime) {
  mbot::Lidar turn{.utime = utime};
  for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
    const auto ray = static_cast<double>(i);
    const float range = scan.ranges_m[i];
    turn.ranges.push_back(std::isfinite(range) ? range : 0.F);
    turn.thetas.push_back(static_cast<float>(scan.angle_min_rad + ray * scan.angle_increment_rad));
    turn.times.push_back(utime + static_cast<std::int64_t>(1e6 * ray * scan.time_increment_s));
    turn.intensities.push_back(1.F);
  }
  return turn;
}

class MbotRobotSim {
 public:
  MbotRobotSim(LcmLink& link, Plant& plant, const SimulatedSetup& setup, MbotGeneration generation)
      : link_(link), plant_(plant), camera_(setup.camera), tags_(setup.world.tags), generation_(generation) {}

  Status run(const JobControl& control) {
    const auto& should_stop = control.cancelled;
    Status status = link_.subscribe("MBOT_VEL_CMD");
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    switched_on_ = std::chrono::duration_cast<Duration>(now) - plant_.uptime();
    PlantPace pace(steady_now, plant_.uptime(), control.note);
    while (status && !should_stop()) {
      const auto next = plant_.next();
      if (!next) return should_stop() ? Status() : tl::unexpected(next.error());
      std::visit([this, &status](const auto& sample) { status = publish_item(sample); }, *next);
      if (status) status = send_what_is_due();
      const Duration left_out = pace.left_out();
      pace.leave_out(plant_.uptime());
      switched_on_ += pace.left_out() - left_out;
      bool waits = true;  // wait until the next sample is due, but at least until all waiting messages are
                          // read
      while (status && waits && !should_stop()) {
        auto message = link_.next(pace.ahead(plant_.uptime()));
        if (!message) return tl::unexpected(message.error());
        if (*message) obey(**message);
        waits = pace.ahead(plant_.uptime()) > Duration(0);
      }
    }
    return status;
  }

 private:
  struct Waiting {
    Duration due{};  ///< uptime of the robot
    mbot::TagArray tags{};
  };

  /// Ignores commands with non-finite values.
  void obey(const LcmMessage& message) {
    const auto twist = mbot::decode<mbot::Twist2D>(message.payload);
    if (!twist || !std::isfinite(twist->vx) || !std::isfinite(twist->wz)) return;
    (void)plant_.command({double{twist->vx}, double{twist->wz}});
  }

  template <class Message>
  Status publish(const char* channel, const Message& message) {
    return link_.publish(channel, mbot::encode(message));
  }
  [[nodiscard]] std::int64_t utime(SensorTime stamp) const {
    return microseconds(stamp.time_since_epoch() + switched_on_);
  }

  Status send_what_is_due() {
    presence_.publish(link_, kSimulatorChannel);
    while (!waiting_.empty() && waiting_.front().due <= plant_.uptime()) {
      if (Status status = publish("MBOT_APRILTAG_ARRAY", waiting_.front().tags); !status) return status;
      waiting_.pop_front();
    }
    if (plant_.uptime() < next_timesync_) return {};
    next_timesync_ = plant_.uptime() + kTimesyncPeriod;
    return publish("MBOT_TIMESYNC", mbot::Timestamp{microseconds(switched_on_ + plant_.uptime())});
  }

  Status publish_item(const Odometry& odometry) {
    const SE2& pose = odometry.odom_T_base;
    const std::int64_t at = utime(odometry.stamp);
    const auto at_m = floats({pose.x(), pose.y(), pose.yaw()});
    Status status = publish("MBOT_ODOMETRY", mbot::Pose2D{at, at_m[0], at_m[1], at_m[2]});
    const auto moves = floats({odometry.speed_m_s, 0, odometry.yaw_rate_rad_s});
    return status ? publish("MBOT_VEL", mbot::Twist2D{at, moves[0], moves[1], moves[2]}) : status;
  }
  Status publish_item(const ImuSample& imu) {
    mbot::Imu message{.utime = utime(imu.stamp), .gyro = floats(imu.angular_velocity_rad_s)};
    message.accel = floats(-imu.linear_acceleration_m_s2);
    message.angles_quat = {1, 0, 0, 0};
    return publish("MBOT_IMU", message);
  }
  Status publish_item(const WheelTicks& wheels) {
    const auto ticks = [](double rad) {
      return static_cast<std::int64_t>(std::llround(rad * kTicksPerTurn / (2 * std::numbers::pi)));
    };
    mbot::Encoders message{.utime = utime(wheels.stamp),
                           .ticks = {ticks(wheels.left_rad), -ticks(wheels.right_rad), 0}};
    for (std::size_t i = 0; i < 3; ++i)
      message.delta_ticks.at(i) = static_cast<std::int32_t>(message.ticks.at(i) - encoders_.ticks.at(i));
    if (encoders_.utime != 0) message.delta_time = static_cast<std::int32_t>(message.utime - encoders_.utime);
    encoders_ = message;
    return publish("MBOT_ENCODERS", message);
  }
  Status publish_item(const LaserScan& scan) { return publish("LIDAR", lidar_of(scan, utime(scan.stamp))); }
  Status publish_item(const TruthPose& truth) {
    const SE2 pose = project_to_plane(truth.map_T_base);
    const auto at_m = floats({pose.x(), pose.y(), pose.yaw()});
    return publish("TRUE_POSE", mbot::Pose2D{utime(truth.stamp), at_m[0], at_m[1], at_m[2]});
  }
  /// Like the detector on an MBot, uses the more likely of the two poses of each tag.
  Status publish_item(const TagFrame& frame) {
    Waiting waiting{.due = std::max(frame.stamp.time_since_epoch() + kTagLatency, plant_.uptime())};
    if (generation_ == MbotGeneration::Jetson) waiting.tags.utime = utime(frame.stamp + kTagLatency);
    for (const TagDetection& seen : frame.detections) {
      const MappedTag* tag = tags_.find(seen.tag);
      const auto pose = tag != nullptr
                            ? estimate_tag_pose(seen, tag->size_m, camera_)
                            : Result<TagPose>(fail(ErrorCode::NotFound, "not a tag of this world"));
      if (pose) waiting.tags.tags.push_back(tag_of(pose->best, seen.tag.number, generation_));
    }
    waiting_.push_back(std::move(waiting));
    return {};
  }
  template <class Other>
  Status publish_item(const Other& /*has no message*/) {
    return {};
  }

  LcmLink& link_;
  Plant& plant_;
  CameraModel camera_;
  TagMap tags_;
  MbotGeneration generation_;
  Duration switched_on_{};  ///< time on the clock of this machine
  Duration next_timesync_{};
  mbot::Encoders encoders_{};
  Presence presence_{};
  std::deque<Waiting> waiting_{};
};

}  // namespace

Status run_mbot_robot_sim(LcmLink& link, Plant& plant, const SimulatedSetup& setup, MbotGeneration generation,
                          const JobControl& control) {
  return MbotRobotSim(link, plant, setup, generation).run(control);
}

}  // namespace waymark

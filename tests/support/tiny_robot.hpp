#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "waymark/geometry/planar.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/samples/robot.hpp"

/// A minimal robot with a simulated clock, and a replayer that uses the robot's odometry as its pose: for
/// tests of code that runs on the loop.
namespace waymark::test {

/// The pose is that of the odometry; there is no estimate if it is lost.
class TrustingMethod final : public LocalizationMethod {
 public:
  explicit TrustingMethod(bool lost) : lost_(lost) {}
  using LocalizationMethod::add;
  void add(const TagFrame& /*frame*/) override {}
  void add(const Odometry& odometry) override {
    if (lost_) return;
    odom_T_base_ = odometry.odom_T_base;
    estimate_ = LocalizationEstimate{.stamp = odometry.stamp, .map_T_base = map_T_odom_ * odom_T_base_};
    estimate_->covariance = Eigen::Matrix3d::Identity() * 1e-6;
    estimate_->certain = confirmed_;
  }
  /// A pose with an uncertainty of metres is not confirmed by tags.
  bool restart_from(const GivenPose& given) override {
    confirmed_ = given.covariance.trace() < 10;
    if (estimate_) estimate_->certain = confirmed_;
    map_T_odom_ = given.map_T_base * odom_T_base_.inverse();
    return true;
  }
  [[nodiscard]] std::optional<LocalizationEstimate> estimate() const override { return estimate_; }

 private:
  bool lost_;
  bool confirmed_ = true;
  SE2 map_T_odom_{};
  SE2 odom_T_base_{};
  std::optional<LocalizationEstimate> estimate_{};
};

/// An interval in which a sensor sends nothing.
struct Silence {
  Duration from = std::chrono::hours(1);
  Duration to = std::chrono::hours(1);
  [[nodiscard]] bool at(Duration time) const { return time >= from && time < to; }
};

/// Moves exactly as commanded. Every 50 ms it sends its pose and two tags, and requests a command.
class TinyRobot final : public Source, public Robot {
 public:
  explicit TinyRobot(const SE2& start = {}) : map_T_base_(start) {}

  Result<std::optional<RobotEvent>> next(Duration /*most*/) override {
    if (dies_after && clock > *dies_after) return fail(ErrorCode::Unreadable, "the robot's process ended");
    if (events_.empty()) pass_time();
    RobotEvent event = std::move(events_.front());
    events_.pop_front();
    return std::optional<RobotEvent>(std::move(event));
  }
  [[nodiscard]] bool more() const override { return true; }
  [[nodiscard]] std::optional<SensorTime> now() const override { return SensorTime(clock); }
  Status command(const VelocityCommand& command) override {
    command_ = command;
    fastest_m_s = std::max(fastest_m_s, std::abs(command.speed_m_s));
    return {};
  }
  [[nodiscard]] Pacing pacing() const {
    return lockstep_time([this] { return clock; });
  }
  [[nodiscard]] const VelocityCommand& last() const { return command_; }
  /// Moves the robot to this pose, as by hand.
  void place(const SE2& map_T_base) { map_T_base_ = map_T_base; }
  [[nodiscard]] double x_m() const { return map_T_base_.x(); }

  Duration clock = std::chrono::milliseconds(1);
  double fastest_m_s = 0;
  std::optional<Duration> dies_after{};
  Silence silent{};         ///< all sensors
  Silence camera_silent{};  ///< only the camera
  Silence wheels_silent{};  ///< only odometry
  bool sends_truth = false;
  std::function<std::optional<LaserScan>()> scan = [] { return std::nullopt; };

 private:
  void pass_time() {
    constexpr double kStep_s = 0.05;
    clock += std::chrono::milliseconds(50);
    map_T_base_ =
        map_T_base_ * SE2::exp({kStep_s * command_.speed_m_s, 0, kStep_s * command_.yaw_rate_rad_s});
    const SensorTime now(clock);
    if (!silent.at(clock)) sense(now);
    events_.emplace_back(CommandRequest{now});
  }
  void sense(SensorTime now) {
    if (sends_truth) events_.emplace_back(Sample(TruthPose{now, lift(map_T_base_)}));
    if (!wheels_silent.at(clock))
      events_.emplace_back(Sample(Odometry{.stamp = now,
                                           .odom_T_base = map_T_base_,
                                           .speed_m_s = command_.speed_m_s,
                                           .yaw_rate_rad_s = command_.yaw_rate_rad_s}));
    if (auto seen = scan()) {
      seen->stamp = now;
      events_.emplace_back(Sample(std::move(*seen)));
    }
    if (camera_silent.at(clock)) return;
    TagFrame frame{.stamp = now, .detections = std::vector<TagDetection>(2)};
    for (int i = 0; i < 2; ++i) frame.detections[static_cast<std::size_t>(i)].tag.number = i;
    frame.detections[0].corners_px[0].x() = to_seconds(clock);  // a camera whose images change
    events_.emplace_back(Sample(frame));
  }

  SE2 map_T_base_;
  VelocityCommand command_{};
  std::deque<RobotEvent> events_{};
};

/// Two metres straight ahead.
inline Route straight_route() {
  Trajectory line;
  for (int i = 0; i <= 40; ++i)
    line.push_back({SensorTime(std::chrono::milliseconds(200 * i)), lift(SE2(0.05 * i, 0, 0))});
  return build_route(line).value();
}

inline RobotModel tiny_model() {
  return {
      .name = "tiny",
      .hull = {.front_m = 0.1, .rear_m = 0.1, .width_m = 0.2, .height_m = 0.2},
      .limits = {.speed_m_s = 1, .yaw_rate_rad_s = 2, .acceleration_m_s2 = 2, .yaw_acceleration_rad_s2 = 8}};
}

inline Replayer tiny_replayer(bool lost = false) {
  return {std::make_unique<TrustingMethod>(lost), straight_route(), {}, tiny_model(), {}};
}

}  // namespace waymark::test

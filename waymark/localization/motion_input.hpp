#pragma once

#include <array>
#include <optional>

#include "waymark/localization/riekf.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A step of motion with its time.
struct MotionSegment {
  SensorTime from{};
  SensorTime to{};
  MotionStep step{};

  /// The part of it up to `stamp`, and the rest: equal twists.
  [[nodiscard]] MotionStep part(SensorTime begin, SensorTime end) const;
};

/// Makes steps of motion of what wheels and gyro say. Odometry gives the way; how the robot turned, the gyro
/// where there is one (MotionInput::rotation).
class MotionInput {
 public:
  explicit MotionInput(const RiekfOptions& options);

  void add(const ImuSample& imu);
  /// The motion since the odometry before; nothing for the first, for one that is not finite or does not go
  /// forwards in time.
  [[nodiscard]] std::optional<MotionSegment> add(const Odometry& odometry);
  /// What may have happened until `to` when nobody says: the last twist goes on, and is doubted.
  [[nodiscard]] MotionSegment guess(SensorTime from, SensorTime to) const;

  [[nodiscard]] int not_forwards() const { return not_forwards_; }
  /// Steps that no robot can have driven.
  [[nodiscard]] int jumps() const { return jumps_; }
  [[nodiscard]] int not_finite() const { return not_finite_; }

 private:
  struct Turned {
    SensorTime stamp{};
    double angle_rad = 0;  ///< since the first
    double rate_rad_s = 0;
  };
  [[nodiscard]] std::optional<double> gyro_angle(SensorTime stamp) const;
  [[nodiscard]] bool stands_still(const MotionStep& step, double wheel_turn_rad) const;
  [[nodiscard]] double dispute(double wheel_turn_rad, const MotionStep& step);
  [[nodiscard]] static bool impossible(const MotionStep& step);
  [[nodiscard]] MotionStep step_of(const Odometry& a, const Odometry& b);

  static constexpr std::size_t kKept = 256;
  bool use_gyro_;
  double bias_sigma_rad_s_;
  double wheel_yaw_rad_sqrt_m_;
  double odometry_scale_;
  double yaw_gain_;
  double gyro_gain_;
  double gyro_bias_rad_s_;
  std::optional<Odometry> last_{};
  std::array<Turned, kKept> turned_{};
  std::size_t turned_count_ = 0;  ///< ever
  double standing_s_ = 0;
  double gyro_rate_ = 0;  ///< both smoothed [rad/s]
  double wheel_rate_ = 0;
  int not_forwards_ = 0;
  int not_finite_ = 0;
  int jumps_ = 0;
  MotionStep last_step_{};
};

}  // namespace waymark

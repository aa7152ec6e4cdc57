#pragma once

#include <deque>
#include <optional>

#include "waymark/replay/motion_predictor.hpp"
#include "waymark/replay/motion_window.hpp"
#include "waymark/samples/calibration.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Two samples this far apart have a gap between them [s].
constexpr double kMotionGap_s = 0.3;

/// What is known of the robot's odometry before it moves: that of an unknown robot, or what a calibration
/// says.
struct OdometryPrior {
  double distance_scale = 1;     ///< true distance over that of odometry
  double distance_share = 0.06;  ///< its uncertainty
  double turn_scale = 1;         ///< true turn over that of odometry
  double turn_share = 0.8;       ///< its uncertainty, as a share of the turn
  double turn_noise_sqrt_m = 0;  ///< random walk of the heading, rad per square root of a metre
};

/// By "odometry_scale", "yaw_gain" and "yaw_noise_rad_sqrt_m"; what the calibration does not know stays.
[[nodiscard]] OdometryPrior odometry_prior(const Calibration& calibration);

/// What the sources said up to a sample of odometry.
struct StampedSums {
  SensorTime stamp{};
  MotionSample sums{};
};

/// What observe() found about standing.
struct Standing {
  bool stands = false;  ///< for a moment already
  /// Of a standstill that is over: the last sample before it, what the sources say now, and how long it was.
  struct Over {
    MotionSample before{};
    MotionSample after{};
    double stood_s = 0;
  };
  std::optional<Over> over{};
};

/// Sums of what commands, wheels and gyro say beside the poses by tags, as samples of the last moments of
/// motion. Learns how the scales of odometry compare with tags and gyro (least squares with forgetting, from
/// motion that has left the window without a contradiction). Standing adds nothing.
class MotionSums {
 public:
  /// Keeps the samples of `kept_s` of motion.
  MotionSums(const ActuatorOptions& actuators, const OdometryPrior& odometry, double kept_s)
      : actuators_(actuators),
        odometry_prior_(odometry),
        kept_s_(kept_s),
        distance_scale_(odometry.distance_scale) {}

  /// False when all before it was forgotten: another clock, or a gap that nobody can bridge.
  bool add(const Odometry& odometry);
  void add(const ImuSample& imu);
  /// The command that acted since the last step.
  void command(const VelocityCommand& sent, double dt_s);
  /// The estimate of now; `tags`: a tag was accepted a moment ago.
  Standing observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags);
  /// No estimate now.
  Standing observe_nothing();

  [[nodiscard]] const std::deque<MotionSample>& samples() const { return samples_; }
  /// The sums up to the newest sample of odometry, and the newest estimate.
  [[nodiscard]] const MotionSample& now() const { return now_; }
  /// Of odometry, oldest first.
  [[nodiscard]] const std::deque<StampedSums>& history() const { return history_; }
  /// The sums at a moment that lies between two samples of odometry, or just after the newest.
  [[nodiscard]] std::optional<MotionSample> at(SensorTime stamp) const;
  [[nodiscard]] MotionScales scales() const;
  /// How long the gyro has said the same, to the last bit, while the robot was asked to turn otherwise; 0: it
  /// has not.
  [[nodiscard]] double gyro_repeats_s() const;
  [[nodiscard]] double path_m() const { return now_.path_m; }
  /// Of the first sample of odometry.
  [[nodiscard]] std::optional<SensorTime> zero() const { return zero_; }
  /// What was before is not held against what comes.
  void forget();

 private:
  Standing keep();
  void learn(const MotionSample& gone);

  ActuatorOptions actuators_;
  OdometryPrior odometry_prior_;
  double kept_s_;
  MotionSample now_{};
  std::deque<MotionSample> samples_;
  std::deque<StampedSums> history_;
  std::optional<SensorTime> zero_{};
  std::optional<Odometry> odometry_{};
  std::optional<SensorTime> imu_{};
  ImuSample repeated_{};    ///< the first sample of those that say the same as the newest
  int repeats_ = 0;         ///< of it since
  double ramp_before_ = 0;  ///< MotionSample::ramp_rad_s at that time
  double motor_m_s_ = 0;
  double motor_rad_s_ = 0;
  double dt_s_ = 0;
  VelocityCommand commanded_{};
  bool estimated_ = false;
  double stood_s_ = 0;
  std::optional<MotionSample> learnt_to_{};
  double distance_scale_;
  double way_way_ = 0;
  double way_tags_ = 0;
  double turn_turn_ = 0;
  double turn_true_ = 0;
  double command_command_ = 0;
  double command_true_ = 0;
};

}  // namespace waymark

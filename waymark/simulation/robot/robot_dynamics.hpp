#pragma once

#include <deque>
#include <string>

#include "waymark/base/fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/base/time.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// How a real robot deviates from an ideal response to commands.
struct DynamicsOptions {
  double speed_lag_s = 0.12;
  double yaw_rate_lag_s = 0.10;
  double command_delay_s = 0.04;
  double turn_gain = 0.85;
  double lateral_slip_s = -0.03;
  double slip_noise_m_s = 0.01;
  double slip_time_s = 0.05;
  std::string drive = "differential";
  double wheelbase_m = 0.2;
  double min_radius_m = 0.4;
  double steering_lag_s = 0.1;
  double steering_rate_rad_s = 4;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.speed_lag_s, Field{"speed_lag_s", "Time constant of the drive motors.", 0, 10});
    visit(self.yaw_rate_lag_s, Field{"yaw_rate_lag_s", "Time constant of the yaw rate.", 0, 10});
    visit(self.command_delay_s, Field{"command_delay_s", "Delay from a command to the motors.", 0, 2});
    visit(self.turn_gain,
          Field{"turn_gain", "Turn response gain: true over commanded yaw rate of a skid-steered robot.",
                0.05, 2});
    visit(self.lateral_slip_s,
          Field{"lateral_slip_s",
                "Lateral slip: lateral velocity per speed and yaw rate; negative: outwards in a curve.", -1,
                1});
    visit(self.slip_noise_m_s,
          Field{"slip_noise_m_s", "Standard deviation of a time-correlated lateral velocity.", 0, 1});
    visit(self.slip_time_s, Field{"slip_time_s", "Correlation time of the lateral velocity.", 1e-3, 10});
    visit(self.drive, Field{"drive", "Drive: differential (skid steering too) or ackermann."});
    visit(self.wheelbase_m,
          Field{"wheelbase_m", "Wheelbase of an Ackermann drive: front axle to rear axle.", 0.01, 10});
    visit(self.min_radius_m,
          Field{"min_radius_m",
                "Minimum turning radius of an Ackermann drive, at the middle of the rear axle.", 0.01, 100});
    visit(self.steering_lag_s,
          Field{"steering_lag_s", "Time constant of the steering of an Ackermann drive.", 0, 10});
    visit(self.steering_rate_rad_s,
          Field{"steering_rate_rad_s", "Maximum steering rate of an Ackermann drive.", 0.01, 100});
  }
};

/// Losses between command and wheels and between wheels and floor, injected by faults.
struct Grip {
  double speed_share = 1;
  double yaw_share = 1;
  double motor_share = 1;  ///< fraction of the commanded speed that the motors reach
  bool blocked = false;    ///< the wheels do not turn
  bool held = false;       ///< the body does not move
};

/// A wheeled robot on a floor with first-order actuators, a delay, a turn response gain and slip. With
/// Ackermann steering, base_link is at the middle of the rear axle, and a command requests a curvature, which
/// is its yaw rate divided by its speed. The front wheels (bicycle model: Rajamani, "Vehicle Dynamics and
/// Control", section 2.2) turn towards it with a lag and a rate limit. The radius of the curve is at least
/// min_radius_m. Deterministic for a given seed.
class RobotDynamics {
 public:
  RobotDynamics(const RobotModel& model, const DynamicsOptions& options, const SE2& map_T_base,
                Random random);

  /// Advances the time by dt, applying the newest command; commands take effect after the delay. O(1).
  void step(const VelocityCommand& command, Duration dt);

  [[nodiscard]] SensorTime now() const { return now_; }
  [[nodiscard]] const SE2& map_T_base() const { return map_T_base_; }
  /// Speed of the wheels.
  [[nodiscard]] double speed_m_s() const { return speed_m_s_; }
  [[nodiscard]] double acceleration_m_s2() const { return acceleration_m_s2_; }
  /// Yaw rate of the body, including the turn response gain.
  [[nodiscard]] double yaw_rate_rad_s() const {
    return grip_.held ? 0.0 : options_.turn_gain * grip_.yaw_share * wheel_yaw_rate_rad_s_;
  }
  /// Angle of the front wheels, positive to the left; 0 for robots without steering.
  [[nodiscard]] double steering_rad() const { return steering_rad_; }
  /// Velocity of the body in base axes: x, y [m/s], yaw rate [rad/s].
  [[nodiscard]] Eigen::Vector3d twist() const;
  /// Rotation of the wheels on each side, not affected by slip and turn response gain.
  [[nodiscard]] WheelTicks wheel_ticks() const { return {now_, left_rad_, right_rad_}; }

  /// Sets the grip from now on.
  void set_grip(const Grip& grip) { grip_ = grip; }
  /// Lifts the robot and puts it down at this pose.
  void place(const SE2& map_T_base) { map_T_base_ = map_T_base; }

 private:
  [[nodiscard]] double next_wheel_yaw_rate(double asked_rad_s, double asked_m_s, double dt_s);
  [[nodiscard]] VelocityCommand delayed(const VelocityCommand& command);
  void slide(double dt_s);

  RobotModel model_;
  DynamicsOptions options_;
  Random random_;
  bool steered_;
  SensorTime now_{};
  SE2 map_T_base_;
  double speed_m_s_ = 0;
  double acceleration_m_s2_ = 0;
  double wheel_yaw_rate_rad_s_ = 0;
  double steering_rad_ = 0;
  Grip grip_{};
  double slip_m_s_ = 0;
  bool slides_ = false;  ///< whether slip_m_s_ has been drawn
  double left_rad_ = 0;
  double right_rad_ = 0;
  std::deque<StampedCommand> pending_;
  VelocityCommand acting_{};
};

}  // namespace waymark

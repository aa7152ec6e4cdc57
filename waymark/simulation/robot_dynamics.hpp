#pragma once

#include <deque>

#include "waymark/base/fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/base/time.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// How far a real robot is from one that does what it is told.
struct DynamicsOptions {
  double speed_lag_s = 0.12;
  double yaw_rate_lag_s = 0.10;
  double command_delay_s = 0.04;
  double yaw_gain = 0.85;
  double lateral_slip_s = -0.03;
  double slip_noise_m_s = 0.01;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.speed_lag_s, Field{"speed_lag_s", "Time constant of the drive motors.", 0, 10});
    visit(self.yaw_rate_lag_s, Field{"yaw_rate_lag_s", "Time constant of turning.", 0, 10});
    visit(self.command_delay_s, Field{"command_delay_s", "From a command to the motors.", 0, 2});
    visit(self.yaw_gain,
          Field{"yaw_gain", "Share of the commanded yaw rate that a skidding robot really turns.", 0.05, 2});
    visit(self.lateral_slip_s,
          Field{"lateral_slip_s", "Sideways speed per speed and yaw rate: outwards in a curve when negative.",
                -1, 1});
    visit(self.slip_noise_m_s,
          Field{"slip_noise_m_s", "Standard deviation of sideways speed, fresh every 0.1 s.", 0, 1});
  }
};

/// A wheeled robot on a floor: first-order actuators behind a delay, yaw gain, slip. Deterministic by seed.
class RobotDynamics {
 public:
  RobotDynamics(const RobotModel& model, const DynamicsOptions& options, const SE2& map_T_base,
                Random random);

  /// Advances the time by dt with the newest command; commands act after the delay. O(1).
  void step(const VelocityCommand& command, Duration dt);

  [[nodiscard]] SensorTime now() const { return now_; }
  [[nodiscard]] const SE2& map_T_base() const { return map_T_base_; }
  [[nodiscard]] double speed_m_s() const { return speed_m_s_; }
  /// Of the body, after the yaw gain.
  [[nodiscard]] double yaw_rate_rad_s() const { return options_.yaw_gain * wheel_yaw_rate_rad_s_; }
  /// How far the wheels of each side have turned: slip and yaw gain are not seen by them.
  [[nodiscard]] WheelTicks wheel_ticks() const { return {now_, left_rad_, right_rad_}; }

 private:
  [[nodiscard]] VelocityCommand delayed(const VelocityCommand& command);

  RobotModel model_;
  DynamicsOptions options_;
  Random random_;
  SensorTime now_{};
  SE2 map_T_base_;
  double speed_m_s_ = 0;
  double wheel_yaw_rate_rad_s_ = 0;
  double slip_m_s_ = 0;
  SensorTime next_slip_{};
  double left_rad_ = 0;
  double right_rad_ = 0;
  std::deque<StampedCommand> pending_;
  VelocityCommand acting_{};
};

}  // namespace waymark

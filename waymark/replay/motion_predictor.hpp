#pragma once

#include <deque>
#include <optional>

#include "waymark/base/fields.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// The configured response of the robot to commands.
struct ActuatorOptions {
  double command_delay_s = 0.04;
  double speed_lag_s = 0.12;
  double yaw_rate_lag_s = 0.10;
  double turn_gain = 1;
  double turn_gain_min = 0.2;
  double turn_gain_max = 1.3;
  double turn_gain_time_s = 8;
  double turn_centre_m = 0;
  double turn_centre_most_m = 0.08;
  double turn_centre_time_s = 30;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.command_delay_s, Field{"command_delay_s", "Delay from a command to the motors.", 0, 1});
    visit(self.speed_lag_s, Field{"speed_lag_s", "Time constant of the speed of the drive motors.", 0, 2});
    visit(self.yaw_rate_lag_s, Field{"yaw_rate_lag_s", "Time constant of the yaw rate.", 0, 2});
    visit(self.turn_gain,
          Field{"turn_gain", "Turn response gain at the start: turned over commanded yaw rate.", 0.1, 3});
    visit(self.turn_gain_min, Field{"turn_gain_min", "Lower bound of the learnt turn gain.", 0.1, 3});
    visit(self.turn_gain_max, Field{"turn_gain_max", "Upper bound of the learnt turn gain.", 0.1, 3});
    visit(self.turn_gain_time_s, Field{"turn_gain_time_s",
                                       "Time constant with which older turns are forgotten when the turn "
                                       "gain is learnt; 0: it is not learnt.",
                                       0, 1000});
    visit(self.turn_centre_m,
          Field{"turn_centre_m",
                "Initial distance ahead of the base origin of the point that does not move sideways in a "
                "turn. A skidding robot does not turn about the middle of its wheels.",
                -0.5, 0.5});
    visit(self.turn_centre_most_m,
          Field{"turn_centre_most_m", "Maximum learnt distance of that point, ahead or behind.", 0, 0.5});
    visit(
        self.turn_centre_time_s,
        Field{
            "turn_centre_time_s",
            "Time constant of turning with which older turns are forgotten when that point is learnt; 0: it "
            "is not learnt.",
            0, 1000});
  }
};

/// The robot's turn response, as learned.
struct LearntTurning {
  double gain = 1;      ///< ratio of actual to commanded yaw rate
  double centre_m = 0;  ///< distance from the base origin forward to the point that does not move sideways
};

/// A predicted pose and the motion at that time.
struct PredictedMotion {
  SE2 map_T_base{};
  double speed_m_s = 0;
  double yaw_rate_rad_s = 0;
};

/// Extrapolates an estimate to the time at which the next command takes effect, modelling the motors as
/// first-order systems with a delay, driven by the commands sent. It learns the turn gain, within bounds, by
/// least squares with forgetting from the turns in the estimate (Ljung, "System Identification", 2nd ed.,
/// section 11.2). In the same way it learns the centre of rotation (of a skid-steer robot: Mandow et al.,
/// "Experimental kinematics for wheeled skid-steer mobile robots", IROS 2007) from the sideways motion of the
/// base during turns. Stores two seconds of commands.
class MotionPredictor {
 public:
  explicit MotionPredictor(const ActuatorOptions& options)
      : options_(options), turning_{options.turn_gain, options.turn_centre_m} {}

  void sent(SensorTime now, const VelocityCommand& command);
  /// Adds an estimate, which is ignored if it is not newer than the last one. `trusted`: whether the turn
  /// response may be learned from it.
  void observe(SensorTime stamp, const SE2& map_T_base, bool trusted);
  /// Pose and motion at time `to`, or the newest observed pose if that is later.
  [[nodiscard]] PredictedMotion predict(SensorTime to) const;
  /// Time at which a command sent at `now` takes effect.
  [[nodiscard]] SensorTime acts_at(SensorTime now) const;

  [[nodiscard]] const LearntTurning& turning() const { return turning_; }
  [[nodiscard]] const ActuatorOptions& options() const { return options_; }

 private:
  struct Motors {
    SensorTime stamp{};
    double speed_m_s = 0;
    double yaw_rate_rad_s = 0;  ///< before applying the turn gain
    double turned_rad = 0;
  };
  void run(Motors& motors, SensorTime to, SE2* map_T_base) const;
  [[nodiscard]] VelocityCommand acting(SensorTime at) const;
  void learn_gain(double asked_rad, double turned_rad, double dt_s);
  void learn_centre(SensorTime stamp, const SE2& map_T_base);

  ActuatorOptions options_;
  std::deque<StampedCommand> commands_{};
  std::optional<Motors> motors_{};  ///< state at the time of the newest estimate
  SE2 map_T_base_{};
  LearntTurning turning_;
  double asked_asked_ = 0;
  double asked_turned_ = 0;
  std::optional<SensorTime> turned_since_{};  ///< start of the next turn to learn the centre from
  SE2 map_T_turned_since_{};
  double turned_turned_ = 0;
  double turned_sideways_ = 0;
};

}  // namespace waymark

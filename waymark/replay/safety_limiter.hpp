#pragma once

#include <optional>
#include <string>

#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

struct SafetyOptions {
  double max_speed_m_s = 0.5;
  double max_yaw_rate_rad_s = 1.5;
  double max_acceleration_m_s2 = 1.0;
  double max_yaw_acceleration_rad_s2 = 6.0;
  double max_odometry_age_s = 0.3;
  double slow_position_sigma_m = 0.05;
  double stop_position_sigma_m = 0.10;
  double max_cross_track_m = 0.30;
  double min_clearance_m = 0.15;
  double start_distance_m = 0.5;
  double start_angle_rad = 0.785;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.max_speed_m_s, Field{"max_speed_m_s", "Never faster.", 0, 10});
    visit(self.max_yaw_rate_rad_s, Field{"max_yaw_rate_rad_s", "Never turn faster.", 0, 20});
    visit(self.max_acceleration_m_s2,
          Field{"max_acceleration_m_s2", "Never speed up faster; stopping may.", 0.01, 50});
    visit(self.max_yaw_acceleration_rad_s2,
          Field{"max_yaw_acceleration_rad_s2", "Never begin to turn faster.", 0.01, 200});
    visit(self.max_odometry_age_s,
          Field{"max_odometry_age_s", "Stop when the newest odometry is older.", 0.01, 10});
    visit(self.slow_position_sigma_m,
          Field{"slow_position_sigma_m", "Slow down when the position is known no better.", 0, 10});
    visit(self.stop_position_sigma_m,
          Field{"stop_position_sigma_m", "Stop when the position is known no better.", 0, 10});
    visit(self.max_cross_track_m, Field{"max_cross_track_m", "Stop when farther from the route.", 0, 10});
    visit(self.min_clearance_m,
          Field{"min_clearance_m", "Stop when the hull comes nearer to a tag, in space.", 0, 10});
    visit(self.start_distance_m, Field{"start_distance_m", "Do not start farther from the route.", 0, 10});
    visit(self.start_angle_rad,
          Field{"start_angle_rad", "Do not start pointing away from the route by more.", 0, 3.2});
  }
};

/// What the limiter must know; all of it comes from outside, time too.
struct SafetyInputs {
  double odometry_age_s = 0;
  bool localized = false;
  double position_sigma_m = 0;  ///< largest standard deviation in the plane
  double cross_track_m = 0;
  double clearance_m = 0;
  double dt_s = 0;         ///< since the last command
  VelocityCommand last{};  ///< the command sent then
};

struct SafetyVerdict {
  VelocityCommand command{};             ///< what may be sent
  std::optional<std::string> stopped{};  ///< why it is a stop, in words
  bool slowed = false;
};

/// The last word before the motors. Pure: the same inputs give the same verdict; a NaN anywhere is a stop.
[[nodiscard]] SafetyVerdict limit(const VelocityCommand& wanted, const SafetyInputs& inputs,
                                  const SafetyOptions& options);

/// Why the robot may not start here, in words that say where to put it; nothing when it may.
[[nodiscard]] std::optional<std::string> start_refusal(double distance_m, double heading_error_rad,
                                                       const SafetyOptions& options);

}  // namespace waymark

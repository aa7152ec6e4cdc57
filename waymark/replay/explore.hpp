#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "waymark/base/fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

struct ExploreOptions {
  double speed_m_s = 0.3;
  double yaw_rate_rad_s = 0.8;
  double ahead_m = 0.45;
  double beside_m = 0.12;
  double heading_noise_rad_s = 0.25;
  double heading_noise_s = 2.0;
  double least_turn_deg = 40;
  double most_turn_deg = 170;
  double max_scan_age_s = 0.5;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.speed_m_s, Field{"speed_m_s", "Speed if no obstacle is near.", 0.01, 2});
    visit(self.yaw_rate_rad_s, Field{"yaw_rate_rad_s", "Yaw rate of turns on the spot.", 0.05, 5});
    visit(
        self.ahead_m,
        Field{"ahead_m", "Distance of an obstacle ahead of the hull below which the robot turns.", 0.05, 5});
    visit(self.beside_m, Field{"beside_m", "Free space required on either side of the hull.", 0, 2});
    visit(self.heading_noise_rad_s,
          Field{"heading_noise_rad_s", "Standard deviation of the random yaw rate while driving.", 0, 2});
    visit(self.heading_noise_s,
          Field{"heading_noise_s", "Correlation time of the random yaw rate.", 0.05, 60});
    visit(self.least_turn_deg, Field{"least_turn_deg", "Smallest random turn.", 0, 360});
    visit(self.most_turn_deg,
          Field{"most_turn_deg", "Largest random turn; turning continues until the space ahead is free.", 0,
                360});
    visit(self.max_scan_age_s,
          Field{"max_scan_age_s", "Maximum age of the newest lidar scan; stops when exceeded.", 0.05, 10});
  }
};

enum class ExploreState : std::uint8_t { Waiting, Forward, Turn };

struct ExploreStep {
  ExploreState state = ExploreState::Waiting;
  VelocityCommand command{};
  std::optional<std::string> reason{};  ///< why the robot has stopped; `nullopt` while it is moving
};

/// Random exploration, as in the exercise "Marker Based Visual Loc" from JdeRobot's Robotics Academy. FORWARD
/// drives with a random heading. When the lidar detects a nearby obstacle, TURN rotates on the spot by a
/// random angle towards the side with more space. Pure: time and random numbers are passed as arguments.
class Explorer {
 public:
  /// `base_T_lidar` is the pose of the lidar in the plane of the base.
  Explorer(const ExploreOptions& options, const RobotModel& robot, const SE2& base_T_lidar, Random random)
      : options_(options), robot_(robot), base_T_lidar_(base_T_lidar), random_(random) {}

  /// Adds a scan. A scan without any valid range means that there is no obstacle nearby. O(rays).
  void add(const LaserScan& scan);
  /// The command at time `now`. To be called at a steady rate.
  [[nodiscard]] ExploreStep step(SensorTime now);

  /// Distance from the front of the hull to the nearest obstacle ahead in the newest scan [m]; infinite if
  /// there is none.
  [[nodiscard]] double free_ahead_m() const { return free_ahead_m_; }
  [[nodiscard]] int turns() const { return turns_; }

 private:
  [[nodiscard]] VelocityCommand forward(double dt_s);
  [[nodiscard]] VelocityCommand turn(double dt_s);
  [[nodiscard]] bool blocked() const;

  ExploreOptions options_;
  RobotModel robot_;
  SE2 base_T_lidar_;
  Random random_;
  ExploreState state_ = ExploreState::Waiting;
  std::optional<SensorTime> scan_stamp_{};
  std::optional<SensorTime> last_step_{};
  double free_ahead_m_ = 0;
  double near_left_m_ = 0;   ///< mean range on the left, with each ray limited to 3 m
  double near_right_m_ = 0;  ///< mean range on the right, likewise
  double wander_rad_s_ = 0;
  double side_ = 1;  ///< direction of the current turn; positive to the left
  double left_to_turn_rad_ = 0;
  int turns_ = 0;
};

}  // namespace waymark

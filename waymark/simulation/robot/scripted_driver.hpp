#pragma once

#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {

/// Drives smoothly, as a person would, with deviations from the line and the target speed.
struct DriverOptions {
  double speed_m_s = 0.3;
  double second_speed_m_s = 0;
  double alternate_m = 3;
  double look_ahead_m = 0.5;
  double lateral_wander_m = 0.02;
  double speed_wander = 0.08;
  double wander_time_s = 3.0;
  double overlap_m = 1.0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.speed_m_s, Field{"speed_m_s", "Cruising speed.", 0.01, 5});
    visit(
        self.second_speed_m_s,
        Field{"second_speed_m_s", "Second cruising speed, used alternately with the first; 0: none.", 0, 5});
    visit(self.alternate_m,
          Field{"alternate_m", "Distance driven at each of the two speeds before switching.", 0.1, 100});
    visit(self.look_ahead_m, Field{"look_ahead_m", "Look-ahead distance of the driver.", 0.05, 5});
    visit(self.lateral_wander_m,
          Field{"lateral_wander_m", "Standard deviation of the lateral deviation from the line.", 0, 1});
    visit(self.speed_wander,
          Field{"speed_wander", "Standard deviation of the speed, as a fraction of it.", 0, 0.5});
    visit(self.wander_time_s,
          Field{"wander_time_s", "Correlation time of the driver's deviations.", 0.1, 60});
    visit(self.overlap_m, Field{"overlap_m", "Distance driven past the start of a closed lap.", 0, 1000});
  }
};

/// Follows a path using pure pursuit of a line that wanders around it (Ornstein-Uhlenbeck). Uses the true
/// pose, like a person watching the robot. Deterministic for a given seed.
class ScriptedDriver {
 public:
  ScriptedDriver(std::vector<PathPoint> path, bool closed, const DriverOptions& options, Random random);

  /// The current stick positions; zero once the lap is complete.
  [[nodiscard]] VelocityCommand drive(const SE2& map_T_base, SensorTime now);
  [[nodiscard]] bool done() const { return done_; }

 private:
  void advance(const SE2& map_T_base);

  std::vector<PathPoint> path_;
  bool closed_;
  DriverOptions options_;
  Random random_;
  std::size_t nearest_ = 0;
  double driven_m_ = 0;
  bool done_ = false;
  SensorTime last_{};
  double offset_ = 0;  ///< in standard deviations
  double haste_ = 0;
};

}  // namespace waymark

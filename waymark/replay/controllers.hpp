#pragma once

#include "waymark/base/fields.hpp"
#include "waymark/replay/motion_predictor.hpp"
#include "waymark/replay/route_progress.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

struct FollowerOptions {
  double reach_m = 0.20;
  double damping = 1.0;
  double integral_m = 1.2;
  double integral_most_m = 0.05;
  double approach_rad = 0.8;
  double stop_within_m = 0.01;
  double brake_m_s2 = 0.5;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.reach_m,
          Field{"reach_m",
                "Distance in which a cross-track error decays; shorter is stiffer and amplifies noise.", 0.05,
                5});
    visit(self.damping, Field{"damping", "Damping ratio; 1: critically damped.", 0.3, 5});
    visit(
        self.integral_m,
        Field{
            "integral_m",
            "Integral distance: a constant cross-track offset is compensated within it; 0: no integral term.",
            0, 100});
    visit(self.integral_most_m,
          Field{"integral_most_m", "Maximum offset that the integral term compensates.", 0, 1});
    visit(self.approach_rad,
          Field{"approach_rad", "Maximum angle between the approach direction and the route.", 0.1, 1.5});
    visit(self.stop_within_m,
          Field{"stop_within_m", "Goal tolerance: distance to the end of the route.", 0.001, 0.5});
    visit(self.brake_m_s2, Field{"brake_m_s2", "Deceleration towards the end of the route.", 0.05, 10});
  }
};

/// Path-following controller with curvature feed-forward, feedback of the cross-track and heading errors, and
/// integral action. Its equations use distance instead of time, so the gains do not depend on the speed
/// (Samson, "Path Following and Time-Varying Feedback Stabilization of a Wheeled Mobile Robot", ICARCV 1992;
/// De Luca, Oriolo and Samson, "Feedback Control of a Nonholonomic Car-like Robot", in Laumond, "Robot Motion
/// Planning and Control", 1998, section 3). It implements equations (1) to (4) of docs/concepts/replay.md,
/// for driving forwards and backwards.
class PathFollower {
 public:
  explicit PathFollower(const FollowerOptions& options) : options_(options) {}

  /// The command for a robot that will be moving as in `motion` when the command takes effect, with foot
  /// point `at`. `remaining_m` is the distance to the end of the route or to the next change of direction.
  [[nodiscard]] VelocityCommand follow(const Route& route, const PredictedMotion& motion,
                                       const RouteProgress& at, double remaining_m,
                                       const ActuatorOptions& actuators, const LearntTurning& turning) const;
  /// Integrates the cross-track error at a foot point that is `driven_m` further along the route than the
  /// previous one.
  void integrate(const RouteProgress& at, double driven_m);
  /// Resets the integral term.
  void reset() { offset_m_ = 0; }
  [[nodiscard]] double offset_m() const { return offset_m_; }

 private:
  FollowerOptions options_;
  double offset_m_ = 0;
};

/// Curvature (turn per distance) of a route around an arc length, averaged over a length of 2 * `half_m`.
[[nodiscard]] double curvature_about(const Route& route, double arc_length_m, double half_m);

struct PurePursuitOptions {
  double look_ahead_m = 0.30;
  double slow_down_m = 0.40;
  double min_speed_m_s = 0.05;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.look_ahead_m,
          Field{"look_ahead_m", "Look-ahead distance; shorter follows closer and oscillates more.", 0.05, 5});
    visit(self.slow_down_m,
          Field{"slow_down_m",
                "Distance before the end of an open route at which the robot begins to slow down.", 0, 5});
    visit(self.min_speed_m_s, Field{"min_speed_m_s", "Minimum speed while slowing down.", 0, 1});
  }
};

/// Steers towards a point ahead on the route along a circular arc (Coulter, "Implementation of the Pure
/// Pursuit Path Tracking Algorithm", CMU-RI-TR-92-01). A baseline controller. O(log points).
[[nodiscard]] VelocityCommand pure_pursuit(const Route& route, const SE2& map_T_base,
                                           const RouteProgress& progress,
                                           const PurePursuitOptions& options = {});

struct GoToPoseOptions {
  double waypoint_m = 0.3;
  double speed_gain_1_s = 0.6;
  double heading_gain_1_s = 2.0;
  double turn_first_rad = 0.25;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.waypoint_m, Field{"waypoint_m", "Spacing of the goals along the route.", 0.05, 5});
    visit(self.speed_gain_1_s,
          Field{"speed_gain_1_s", "Proportional gain from the distance to the goal to the speed.", 0.01, 10});
    visit(
        self.heading_gain_1_s,
        Field{"heading_gain_1_s", "Proportional gain from the angle to the goal to the yaw rate.", 0.01, 20});
    visit(self.turn_first_rad,
          Field{"turn_first_rad", "Angle to the goal above which the robot turns on the spot.", 0.01, 3});
  }
};

/// Drives from one goal to the next by distance and direction, turning on the spot first; the goals are
/// points on the route. Student projects use this controller (Martins and Ramos, "AprilTag-based Trajectory
/// Tracking for the LIMOS Robot", go_to_pose); it is provided for comparison. O(log points).
[[nodiscard]] VelocityCommand go_to_pose(const Route& route, const SE2& map_T_base,
                                         const RouteProgress& progress, const GoToPoseOptions& options = {});

}  // namespace waymark

#pragma once

#include <limits>
#include <optional>
#include <string>

#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

struct SafetyOptions {
  double max_speed_m_s = 0.5;
  double max_yaw_rate_rad_s = 1.5;
  double max_curvature_1_m = 0;
  double max_acceleration_m_s2 = 1.0;
  double max_deceleration_m_s2 = 2.5;
  double max_yaw_acceleration_rad_s2 = 6.0;
  double max_odometry_age_s = 0.3;
  double max_scan_age_s = 0.5;
  double max_picture_age_s = 1.0;
  double max_blind_m = 0.5;
  double slow_position_sigma_m = 0.05;
  double stop_position_sigma_m = 0.10;
  int max_contradicting_frames = 1;
  double max_cross_track_m = 0.30;
  double min_clearance_m = 0.15;
  double slow_obstacle_m = 0.60;
  double stop_obstacle_m = 0.20;
  double start_distance_m = 0.5;
  double start_angle_rad = 0.785;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.max_speed_m_s, Field{"max_speed_m_s", "Maximum speed.", 0, 10});
    visit(self.max_yaw_rate_rad_s, Field{"max_yaw_rate_rad_s", "Maximum yaw rate.", 0, 20});
    visit(self.max_curvature_1_m,
          Field{"max_curvature_1_m", "Maximum curvature of the commands, for steered wheels; 0: no limit.", 0,
                1000});
    visit(self.max_acceleration_m_s2, Field{"max_acceleration_m_s2", "Maximum acceleration.", 0.01, 50});
    visit(self.max_deceleration_m_s2,
          Field{"max_deceleration_m_s2", "Maximum deceleration, including stops.", 0.1, 50});
    visit(self.max_yaw_acceleration_rad_s2,
          Field{"max_yaw_acceleration_rad_s2", "Maximum yaw acceleration.", 0.01, 200});
    visit(self.max_odometry_age_s,
          Field{"max_odometry_age_s",
                "Maximum age of the newest odometry and gyro sample; stops when exceeded.", 0.01, 10});
    visit(
        self.max_scan_age_s,
        Field{"max_scan_age_s",
              "Maximum age of the newest lidar scan once one was received; stops when exceeded.", 0.05, 10});
    visit(self.max_picture_age_s,
          Field{"max_picture_age_s",
                "Maximum age of the newest picture once one was received; stops when exceeded.", 0.1, 60});
    visit(self.max_blind_m,
          Field{"max_blind_m",
                "Maximum distance without an accepted tag beyond the longest such stretch of the taught lap; "
                "stops when exceeded.",
                0, 1000});
    visit(self.slow_position_sigma_m,
          Field{"slow_position_sigma_m",
                "Standard deviation of the position above which the robot slows down.", 0, 10});
    visit(self.stop_position_sigma_m, Field{"stop_position_sigma_m",
                                            "Standard deviation of the position above which the robot stops; "
                                            "it continues below slow_position_sigma_m.",
                                            0, 10});
    visit(self.max_contradicting_frames, Field{"max_contradicting_frames",
                                               "Maximum number of consecutive frames that contradict the "
                                               "position; stops when exceeded, slows down from the first.",
                                               0, 100});
    visit(self.max_cross_track_m,
          Field{"max_cross_track_m", "Maximum distance from the route; stops when exceeded.", 0, 10});
    visit(
        self.min_clearance_m,
        Field{"min_clearance_m", "Minimum distance in space from the hull to a tag; stops below it.", 0, 10});
    visit(self.slow_obstacle_m,
          Field{"slow_obstacle_m",
                "Free distance before the hull by the lidar below which the robot slows down.", 0, 20});
    visit(self.stop_obstacle_m,
          Field{"stop_obstacle_m", "Free distance before the hull by the lidar below which the robot stops.",
                0, 20});
    visit(self.start_distance_m,
          Field{"start_distance_m", "Maximum distance from the route at the start.", 0, 10});
    visit(self.start_angle_rad,
          Field{"start_angle_rad", "Maximum angle to the direction of the route at the start.", 0, 3.2});
  }
};

/// What the limiter must know; all of it comes from outside, time too.
struct SafetyInputs {
  double odometry_age_s = 0;
  double gyro_age_s = 0;      ///< 0 for a robot without one
  double scan_age_s = 0;      ///< 0 for a robot without a lidar
  double picture_age_s = 0;   ///< 0 before the first picture
  double blind_m = 0;         ///< way driven since a tag was accepted
  double taught_blind_m = 0;  ///< longest stretch without a tag in the taught lap
  std::string missed{};       ///< tags that should be in view and were not found, in words
  bool localized = false;
  double position_sigma_m = 0;   ///< largest standard deviation in the plane
  int contradicting_frames = 0;  ///< frames in a row, up to the newest, that contradict the position
  bool unsure = false;           ///< the last verdict's: the robot already stands for want of a position
  double cross_track_m = 0;
  double clearance_m = 0;
  double obstacle_m = std::numeric_limits<double>::infinity();  ///< free way before the hull
  double dt_s = 0;                                              ///< since the last command
  VelocityCommand last{};                                       ///< the command sent then
  std::string alarm{};  ///< what somebody else found that is reason enough to stop, in words; empty: nothing
};

struct SafetyVerdict {
  VelocityCommand command{};             ///< what may be sent
  std::optional<std::string> stopped{};  ///< why it is a stop, in words; the command then brakes to zero
  bool slowed = false;
  bool unsure = false;  ///< stopped because the position is not known well enough
};

/// The last word before the motors. Pure: the same inputs give the same verdict; a NaN anywhere is a stop. A
/// stop brakes, on the curve that was being driven, with max_deceleration_m_s2.
[[nodiscard]] SafetyVerdict limit(const VelocityCommand& wanted, const SafetyInputs& inputs,
                                  const SafetyOptions& options);

/// Why the robot may not start here, in words that say where to put it; nothing when it may. `distance_m` is
/// positive when the robot is to the left of the route, the angle when it points to its left.
[[nodiscard]] std::optional<std::string> start_refusal(double distance_m, double heading_error_rad,
                                                       const SafetyOptions& options);

/// How far the hull, widened by `margin_m` on both sides, can drive on a curve before it meets what a scan
/// saw: forwards, or backwards when `backwards`. Infinite when nothing is in the way within `reach_m`. Points
/// inside the hull are the robot itself. O(rays).
[[nodiscard]] double free_way_m(const LaserScan& scan, const SE2& base_T_lidar, const Hull& hull,
                                double curvature_1_m, bool backwards, double margin_m = 0.03,
                                double reach_m = 3);

}  // namespace waymark

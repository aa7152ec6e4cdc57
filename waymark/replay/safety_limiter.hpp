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
  double max_image_age_s = 1.0;
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
    visit(self.max_image_age_s,
          Field{"max_image_age_s",
                "Maximum age of the newest image once one was received; stops when exceeded.", 0.1, 60});
    visit(
        self.max_blind_m,
        Field{"max_blind_m",
              "Maximum distance without an accepted tag beyond the longest such distance of the taught lap; "
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
                "Free distance ahead of the hull by the lidar below which the robot slows down.", 0, 20});
    visit(self.stop_obstacle_m,
          Field{"stop_obstacle_m",
                "Free distance ahead of the hull by the lidar below which the robot stops.", 0, 20});
    visit(self.start_distance_m,
          Field{"start_distance_m", "Maximum distance from the route at the start.", 0, 10});
    visit(self.start_angle_rad,
          Field{"start_angle_rad", "Maximum angle to the direction of the route at the start.", 0, 3.2});
  }
};

/// Inputs of the limiter, including time.
struct SafetyInputs {
  double odometry_age_s = 0;
  double gyro_age_s = 0;      ///< 0 if the robot has no gyro
  double scan_age_s = 0;      ///< 0 if the robot has no lidar
  double image_age_s = 0;     ///< 0 before the first image
  double blind_m = 0;         ///< distance driven since the last accepted tag
  double taught_blind_m = 0;  ///< longest distance without a tag in the taught lap
  std::string missed{};       ///< description of tags that were expected but not found
  bool localized = false;
  double position_sigma_m = 0;   ///< largest standard deviation in the plane
  int contradicting_frames = 0;  ///< number of consecutive contradicting frames, up to the newest
  bool unsure = false;  ///< SafetyVerdict::unsure from the last verdict: whether the robot is stopped due to
                        ///< position uncertainty
  double cross_track_m = 0;
  double clearance_m = 0;
  double obstacle_m = std::numeric_limits<double>::infinity();  ///< free distance ahead of the hull
  double dt_s = 0;                                              ///< time since the last command
  VelocityCommand last{};                                       ///< the previous command
  std::string alarm{};  ///< reason to stop from another check; empty if there is none
};

struct SafetyVerdict {
  VelocityCommand command{};             ///< command that may be sent
  std::optional<std::string> stopped{};  ///< reason for a stop; the command then brakes to zero
  bool slowed = false;
  bool unsure = false;  ///< stopped because the position uncertainty is too large
};

/// Limits a command; every command to the motors passes through this function. Pure: equal inputs give equal
/// verdicts. Any NaN causes a stop. A stop brakes along the current curve at max_deceleration_m_s2.
[[nodiscard]] SafetyVerdict limit(const VelocityCommand& wanted, const SafetyInputs& inputs,
                                  const SafetyOptions& options);

/// The reason why the robot may not start at this position, and how to correct it; `nullopt` if it may start.
/// `distance_m` is positive if the robot is to the left of the route, and the heading error is positive if it
/// points to the left.
[[nodiscard]] std::optional<std::string> start_refusal(double distance_m, double heading_error_rad,
                                                       const SafetyOptions& options);

/// Distance that the hull, widened by `margin_m` on both sides, can travel along a curve before it reaches an
/// obstacle in a scan; in reverse if `backwards`. Infinite if there is no obstacle within `reach_m`. Points
/// inside the hull are part of the robot. O(rays).
[[nodiscard]] double free_way_m(const LaserScan& scan, const SE2& base_T_lidar, const Hull& hull,
                                double curvature_1_m, bool backwards, double margin_m = 0.03,
                                double reach_m = 3);

}  // namespace waymark

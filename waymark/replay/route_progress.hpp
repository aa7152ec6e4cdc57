#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/samples/route.hpp"

namespace waymark {

/// Position of a robot relative to a route.
struct RouteProgress {
  std::size_t index = 0;         ///< index of the route point at or before the foot point
  double arc_length_m = 0;       ///< arc length at the foot point
  double cross_track_m = 0;      ///< positive if the robot is to the left of the route
  double heading_error_rad = 0;  ///< heading of the robot minus heading of the route
  SE2 map_T_route{};             ///< pose at the foot point, facing in the robot's driving direction
  double leg_begin_m = 0;        ///< start of the leg, a part of the route without a change of direction
  double leg_end_m = 0;          ///< end of the leg, or of the whole route if the direction never changes
};

/// The foot point on the route nearest to the robot, at or after `from_m`. If branches of the route are close
/// to each other, the heading decides; one radian counts as much as 0.3 m. O(points).
[[nodiscard]] RouteProgress locate(const Route& route, const SE2& map_T_base, double from_m = 0);

/// The foot point near the previous one. Searches `window_m` ahead and slightly back, so that the robot does
/// not jump to another branch where a route crosses itself or closes. At a change of direction, the next leg
/// begins once the robot is within `turn_within_m`. O(window).
[[nodiscard]] RouteProgress advance(const Route& route, const SE2& map_T_base, const RouteProgress& before,
                                    double window_m = 0.5, double turn_within_m = 0.02);

/// The pose on the route at an arc length. Arc lengths wrap around on a closed route and are clamped on an
/// open one.
[[nodiscard]] SE2 pose_at(const Route& route, double arc_length_m);

/// Provides the next station on a route and the remaining dwell time at the current one. Distances are arc
/// lengths that keep increasing over the laps of a closed route. It is pure apart from its stored state; time
/// is passed as an argument.
class StationStops {
 public:
  StationStops() = default;
  explicit StationStops(const Route& route)
      : stations_(route.stations), closed_(route.closed), length_m_(route.length_m) {}

  /// Begins or resumes at this distance: stations before it are skipped. A station that has been served is
  /// not served again.
  void begin(double way_m);
  /// Updates the distance. The robot has arrived at a station once it is at most `within_m` short of it.
  void arrive(double way_m, double within_m);
  /// Adds time spent stationary; once the dwell time is over, the next station is selected.
  void dwell(double dt_s);

  /// Distance to the next station; infinite if there is none.
  [[nodiscard]] double left_m(double way_m) const;
  /// The station at which the robot is stopped; nullptr while it is driving.
  [[nodiscard]] const Station* current() const { return at_station_ ? &stations_[next_] : nullptr; }
  [[nodiscard]] double left_s() const { return left_s_; }

 private:
  void aim(double from_m);

  std::vector<Station> stations_{};
  bool closed_ = false;
  double length_m_ = 0;
  std::size_t next_ = 0;
  std::optional<double> next_way_m_{};
  std::optional<double> served_way_m_{};
  bool at_station_ = false;
  double left_s_ = 0;
};

}  // namespace waymark

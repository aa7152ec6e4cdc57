#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/samples/route.hpp"

namespace waymark {

/// Where a robot is beside a route.
struct RouteProgress {
  std::size_t index = 0;         ///< of the point at or before the foot point
  double arc_length_m = 0;       ///< of the foot point
  double cross_track_m = 0;      ///< signed: positive when the robot is to the left of the route
  double heading_error_rad = 0;  ///< robot's heading less the route's
  SE2 map_T_route{};             ///< foot point, heading of the robot there
  double leg_begin_m = 0;        ///< stretch that is driven without changing direction: where it begins …
  double leg_end_m = 0;          ///< … and ends; the whole route where it never changes
};

/// The foot point nearest to the robot anywhere on the route, at or beyond `from_m`. Where branches of the
/// route are near each other, the one whose heading is that of the robot: a radian counts as much as 0.3 m.
/// O(points).
[[nodiscard]] RouteProgress locate(const Route& route, const SE2& map_T_base, double from_m = 0);

/// The foot point near where it was before: looks `window_m` ahead and a little back, so that the robot
/// cannot jump to another branch where a route crosses itself or closes. Where the direction changes the
/// robot must have come within `turn_within_m` before what follows counts. O(window).
[[nodiscard]] RouteProgress advance(const Route& route, const SE2& map_T_base, const RouteProgress& before,
                                    double window_m = 0.5, double turn_within_m = 0.02);

/// The pose of the route at an arc length; a closed route goes round, an open one ends.
[[nodiscard]] SE2 pose_at(const Route& route, double arc_length_m);

/// Which station of a route comes next, and how long the robot still stands at it. Ways are arc lengths that
/// go on growing where a closed route begins again. Pure but for what it remembers; time is an argument.
class StationStops {
 public:
  StationStops() = default;
  explicit StationStops(const Route& route)
      : stations_(route.stations), closed_(route.closed), length_m_(route.length_m) {}

  /// The robot is put on the route here, or goes on from here: what lies behind is passed. A station that was
  /// served is not served again.
  void begin(double way_m);
  /// The robot is here now; it has arrived at a station from `within_m` before it on.
  void arrive(double way_m, double within_m);
  /// It stood for so long; at the end of the pause the next station comes.
  void dwell(double dt_s);

  /// Way to the next station; infinite when there is none.
  [[nodiscard]] double left_m(double way_m) const;
  /// The station the robot stands at; nullptr while it drives.
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

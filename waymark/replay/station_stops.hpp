#pragma once

#include <optional>
#include <vector>

#include "waymark/samples/route.hpp"

namespace waymark {

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
  void stand(double dt_s);

  /// Way to the next station; infinite when there is none.
  [[nodiscard]] double left_m(double way_m) const;
  /// The station the robot stands at; nullptr while it drives.
  [[nodiscard]] const Station* standing() const { return standing_ ? &stations_[next_] : nullptr; }
  [[nodiscard]] double left_s() const { return left_s_; }

 private:
  void aim(double from_m);

  std::vector<Station> stations_{};
  bool closed_ = false;
  double length_m_ = 0;
  std::size_t next_ = 0;
  std::optional<double> next_way_m_{};
  std::optional<double> served_way_m_{};
  bool standing_ = false;
  double left_s_ = 0;
};

}  // namespace waymark

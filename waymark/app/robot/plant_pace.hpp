#pragma once

#include <functional>
#include <string>

#include "waymark/base/time.hpp"

namespace waymark {

/// Real time for a plant. What a busy computer is late by beyond 100 ms is left out, not made up for: a robot
/// must not drive faster than commanded. Samples are to be stamped that much later.
class PlantPace {
 public:
  /// `clock`: steady. `uptime`: of the plant, now. `say` is told of time that was left out, at most once in
  /// ten seconds.
  PlantPace(std::function<Duration()> clock, Duration uptime, std::function<void(const std::string&)> say);

  /// How long until the clock has come to this uptime; 0 if it has.
  [[nodiscard]] Duration ahead(Duration uptime) const;
  /// Leaves out what is late by too much. Call it once a sample.
  void leave_out(Duration uptime);
  /// All that was left out.
  [[nodiscard]] Duration left_out() const { return left_out_; }

 private:
  std::function<Duration()> clock_;
  std::function<void(const std::string&)> say_;
  Duration began_;  ///< by the clock, when uptime was zero
  Duration left_out_{};
  Duration said_{};     ///< left_out() when it was said last
  Duration next_said_;  ///< by the clock
};

}  // namespace waymark

#pragma once

#include <optional>

#include "waymark/base/time.hpp"

namespace waymark {

/// What the robot's clock shows now, by when its samples arrive here: the sample that took least on its way
/// in the last ten to twenty seconds says how the clocks differ. Behind the truth by that sample's way.
class ArrivalClock {
 public:
  /// `arrived`: by the steady clock here; never backwards.
  void receive(SensorTime stamp, Duration arrived);
  /// Nothing before the first sample.
  [[nodiscard]] std::optional<SensorTime> at(Duration now) const;

 private:
  std::optional<Duration> least_{};   ///< arrived - stamp, in the window that runs
  std::optional<Duration> before_{};  ///< in the window before
  Duration window_began_{};
};

}  // namespace waymark

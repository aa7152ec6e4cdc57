#pragma once

#include <map>
#include <optional>
#include <string>

#include "waymark/base/error.hpp"
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

/// Refuses stamps that would mislead an estimator: those that go back within a topic, and those of another
/// clock than the odometry's. The clocks of robot and computer may differ by any amount, which is measured;
/// when one of them is set while they run, everything after it is refused: samples before and after it have
/// no common time.
class StampGate {
 public:
  /// Fails, and says why, on a stamp that is refused. `arrived`: steady clock here. `leads`: the topic whose
  /// clock counts; other topics are refused until it spoke.
  Status pass(const std::string& topic, SensorTime stamp, Duration arrived, bool leads);
  /// Steady clock here less the robot's, in the mean of the last hundred odometry messages; nothing before
  /// the first.
  [[nodiscard]] std::optional<Duration> offset() const { return offset_; }

 private:
  [[nodiscard]] Error refused(const std::string& topic, Duration offset, Duration arrived, bool leads);

  /// An offset that the leading topic has shown since `since`, another than the one that counts.
  struct OtherOffset {
    Duration offset{};
    Duration since{};
  };
  std::optional<Duration> offset_{};
  std::optional<OtherOffset> other_{};
  std::map<std::string, SensorTime> newest_{};
};

}  // namespace waymark

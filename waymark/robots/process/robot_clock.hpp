#pragma once

#include <map>
#include <optional>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"

namespace waymark {

/// Estimates the current time on the robot's clock from the arrival of its samples. The clock offset is
/// determined from the sample with the smallest delay in the last ten to twenty seconds. The estimate lags
/// behind by that delay.
class ArrivalClock {
 public:
  /// `arrived` is on the steady clock of this computer and must not decrease.
  void receive(SensorTime stamp, Duration arrived);
  /// `nullopt` before the first sample.
  [[nodiscard]] std::optional<SensorTime> at(Duration now) const;

 private:
  std::optional<Duration> least_{};   ///< smallest difference arrived - stamp in the current window
  std::optional<Duration> before_{};  ///< the same for the previous window
  Duration window_began_{};
};

/// Rejects timestamps that would mislead an estimator: those that decrease within a topic, and those from a
/// clock other than that of the odometry. The clocks of robot and computer may differ by any amount, which is
/// measured. If one of the clocks is set during operation, all later samples are rejected, because they do
/// not share a clock with the earlier ones.
class StampGate {
 public:
  /// Fails with the reason if the timestamp is rejected. `arrived` is on the steady clock of this computer.
  /// `leads`: whether the topic defines the clock (odometry); other topics are rejected until its first
  /// message.
  Status pass(const std::string& topic, SensorTime stamp, Duration arrived, bool leads);
  /// Steady clock of this computer minus the robot's clock, averaged over roughly the last hundred odometry
  /// messages; `nullopt` before the first.
  [[nodiscard]] std::optional<Duration> offset() const { return offset_; }

 private:
  [[nodiscard]] Error refused(const std::string& topic, Duration offset, Duration arrived, bool leads);

  /// An offset of the leading topic that has differed from the accepted one since `since`.
  struct OtherOffset {
    Duration offset{};
    Duration since{};
  };
  std::optional<Duration> offset_{};
  std::optional<OtherOffset> other_{};
  std::map<std::string, SensorTime> newest_{};
};

}  // namespace waymark

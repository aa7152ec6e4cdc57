#pragma once

#include <map>
#include <optional>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"

namespace waymark {

/// Estimates the current time of the robot's clock from the arrival of its samples. The clock offset is
/// determined from the sample with the smallest delay in the last ten to twenty seconds. The estimate lags by
/// that delay.
class ArrivalClock {
 public:
  /// `arrived`: steady clock of this computer; must not decrease.
  void receive(SensorTime stamp, Duration arrived);
  /// Empty before the first sample.
  [[nodiscard]] std::optional<SensorTime> at(Duration now) const;

 private:
  std::optional<Duration> least_{};   ///< smallest arrived - stamp in the current window
  std::optional<Duration> before_{};  ///< in the window before
  Duration window_began_{};
};

/// Rejects stamps that would mislead an estimator: those that decrease within a topic, and those that are not
/// of the odometry's clock. The clocks of robot and computer may differ by any amount, which is measured. If
/// one of the clocks is set during operation, all later samples are rejected, because they share no clock
/// with the earlier ones.
class StampGate {
 public:
  /// Fails with the reason if the stamp is rejected. `arrived`: steady clock of this computer. `leads`: the
  /// topic defines the clock (odometry); other topics are rejected until its first message.
  Status pass(const std::string& topic, SensorTime stamp, Duration arrived, bool leads);
  /// Steady clock of this computer minus the robot's clock, averaged over about the last hundred odometry
  /// messages; empty before the first.
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

#pragma once

#include <optional>

#include "waymark/base/time.hpp"

namespace waymark {

/// Stamps of messages that a robot sends at even times and that carry none, by when they arrive. What delays
/// a message (the UART's and the USB bridge's buffers, this machine's scheduler) only ever makes it late, so
/// the stamps follow the earliest arrivals of the last messages on an even beat, whose period is learned.
/// The same idea with stamps of the sender: Olson, "A passive solution to the sensor synchronization problem"
/// (IROS 2010), section III. Stamps are on the clock of the arrivals, never after the arrival, and always
/// grow.
class FrameClock {
 public:
  /// `lost`: something before it was not understood, so that a message may be missing.
  [[nodiscard]] SensorTime stamp(Duration arrived, bool lost = false);
  /// Of the messages; nothing while too few came.
  [[nodiscard]] std::optional<double> period_s() const;

 private:
  void learn(double arrived_s);
  void correct(double late_s);

  int messages_ = 0;
  double first_s_ = 0;
  double period_s_ = 0;
  double beat_s_ = 0;        ///< of the newest message
  double least_late_s_ = 0;  ///< in the window that runs
  int in_window_ = 0;
  std::optional<SensorTime> newest_{};
};

}  // namespace waymark

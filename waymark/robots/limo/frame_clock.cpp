#include "waymark/robots/limo/frame_clock.hpp"

#include <algorithm>
#include <cmath>

namespace waymark {
namespace {

constexpr int kLearning = 32;                 ///< messages until the beat is used
constexpr int kWindow = 16;                   ///< messages whose earliest arrival corrects the beat
constexpr double kPhaseShare = 0.25;          ///< of what the window found late
constexpr double kPeriodShare = 0.1;          ///< of the drift within a window
constexpr double kMostPeriods = 25;           ///< a longer silence begins anew
constexpr double kLeastPeriodSeconds = 5e-4;  ///< a shorter one was learned from what had piled up
constexpr double kMissing = 0.6;  ///< periods that even the earliest is late: a message is missing

SensorTime time_of(double seconds) {
  return SensorTime(Duration(static_cast<std::int64_t>(std::round(seconds * 1e9))));
}

}  // namespace

std::optional<double> FrameClock::period_s() const {
  return messages_ < kLearning ? std::nullopt : std::optional(period_s_);
}

void FrameClock::learn(double arrived_s) {
  if (messages_ == 0) first_s_ = arrived_s;
  beat_s_ = arrived_s;
  if (messages_ > 0) period_s_ = (arrived_s - first_s_) / messages_;
}

void FrameClock::correct(double late_s) {
  least_late_s_ = in_window_ == 0 ? late_s : std::min(least_late_s_, late_s);
  if (late_s < 0) {  // nothing arrives before it was sent
    beat_s_ += late_s;
    least_late_s_ -= late_s;
    period_s_ += kPeriodShare * late_s / kWindow;
  }
  if (++in_window_ < kWindow) return;
  in_window_ = 0;
  if (least_late_s_ > kMissing * period_s_) {
    beat_s_ += std::round(least_late_s_ / period_s_) * period_s_;
    return;
  }
  beat_s_ += kPhaseShare * least_late_s_;
  period_s_ += kPeriodShare * least_late_s_ / kWindow;
}

SensorTime FrameClock::stamp(Duration arrived, bool lost) {
  const double arrived_s = to_seconds(arrived);
  const bool useless = period_s_ < kLeastPeriodSeconds || arrived_s - beat_s_ > kMostPeriods * period_s_;
  if (messages_ >= kLearning && useless) messages_ = 0;
  if (messages_ < kLearning) {
    learn(arrived_s);
  } else {
    const double beats = lost ? std::round((arrived_s - beat_s_) / period_s_) : 1;
    beat_s_ += std::max(1.0, beats) * period_s_;
    correct(arrived_s - beat_s_);
  }
  ++messages_;
  SensorTime stamp = time_of(std::min(beat_s_, arrived_s));
  if (newest_) stamp = std::max(stamp, *newest_ + Duration(1));
  newest_ = stamp;
  return stamp;
}

}  // namespace waymark

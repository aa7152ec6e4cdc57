#include "waymark/robots/process/arrival_clock.hpp"

#include <algorithm>

namespace waymark {
namespace {
constexpr Duration kWindow = std::chrono::seconds(10);
}  // namespace

void ArrivalClock::receive(SensorTime stamp, Duration arrived) {
  const Duration difference = arrived - stamp.time_since_epoch();
  if (!least_) window_began_ = arrived;
  if (least_ && arrived - window_began_ > kWindow) {
    before_ = least_;
    least_ = difference;
    window_began_ = arrived;
  }
  least_ = least_ ? std::min(*least_, difference) : difference;
}

std::optional<SensorTime> ArrivalClock::at(Duration now) const {
  if (!least_) return std::nullopt;
  return SensorTime(now - std::min(*least_, before_.value_or(*least_)));
}

}  // namespace waymark

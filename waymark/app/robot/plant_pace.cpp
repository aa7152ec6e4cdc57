#include "waymark/app/robot/plant_pace.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr Duration kMostLate = std::chrono::milliseconds(100);
constexpr Duration kSayAgain = std::chrono::seconds(10);

}  // namespace

PlantPace::PlantPace(std::function<Duration()> clock, Duration uptime,
                     std::function<void(const std::string&)> say)
    : clock_(std::move(clock)), say_(std::move(say)), began_(clock_() - uptime), next_said_(clock_()) {}

Duration PlantPace::ahead(Duration uptime) const { return std::max(Duration(0), began_ + uptime - clock_()); }

void PlantPace::leave_out(Duration uptime) {
  const Duration now = clock_();
  const Duration lost = now - uptime - began_ - kMostLate;
  if (lost > Duration(0)) {
    began_ += lost;
    left_out_ += lost;
  }
  constexpr Duration kWorthSaying = std::chrono::milliseconds(50);
  if (left_out_ - said_ < kWorthSaying || now < next_said_) return;
  say_(fmt::format("this computer is too slow or was suspended: simulated time was paused for {:.2f} s",
                   to_seconds(left_out_ - std::exchange(said_, left_out_))));
  next_said_ = now + kSayAgain;
}

}  // namespace waymark

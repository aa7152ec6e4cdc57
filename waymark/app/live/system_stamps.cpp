#include "waymark/app/live/system_stamps.hpp"

#include <chrono>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>

#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr Duration kJump = std::chrono::milliseconds(50);  // more than a clock is slewed within a second
constexpr int kTries = 5;

}  // namespace

SystemClocks system_clocks() {
  return {.steady = steady_now, .system = [] {
            return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch());
          }};
}

SystemStamps::SystemStamps(SystemClocks clocks)
    : clocks_(std::move(clocks)), difference_(measured()), latest_(difference_) {}

/// By the pair of readings that took least time.
Duration SystemStamps::measured() const {
  Duration best{};
  Duration least = Duration::max();
  for (int i = 0; i < kTries; ++i) {
    const Duration before = clocks_.steady();
    const Duration system = clocks_.system();
    const Duration after = clocks_.steady();
    if (after - before >= least) continue;
    least = after - before;
    best = system - before - least / 2;
  }
  return best;
}

std::optional<std::string> SystemStamps::take_jump() {
  const Duration now = measured();
  const Duration jump = now - std::exchange(latest_, now);
  if (std::chrono::abs(jump) < kJump) return std::nullopt;
  return fmt::format("the clock of this computer was set {} by {:.3f} s; stamps go on as if it had not been",
                     jump > Duration(0) ? "forward" : "back", std::abs(to_seconds(jump)));
}

}  // namespace waymark

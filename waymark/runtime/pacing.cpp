#include "waymark/runtime/pacing.hpp"

#include <chrono>
#include <utility>

namespace waymark {

Pacing real_time() {
  return {.clock = [] {
    return std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch());
  }};
}

Pacing lockstep_time(std::function<Duration()> robots_clock) {
  return {.clock = std::move(robots_clock), .lockstep = true};
}

}  // namespace waymark

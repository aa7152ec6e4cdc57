#include "waymark/robots/wire/simulation_watch.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace waymark {

bool SimulationWatch::silent(Duration now) const { return heard_ && now - *heard_ > options_.silent; }

bool SimulationWatch::ended(Duration now) const {
  return heard_ && now - std::max(*heard_, clock_.value_or(*heard_)) > options_.ended;
}

std::string SimulationWatch::take_words(Duration now, bool drives) {
  const bool is_silent = silent(now);
  if (is_silent == was_silent_) return {};
  was_silent_ = is_silent;
  if (!is_silent) return drives ? "odometry comes again: commands count again" : "odometry comes again";
  const bool clock_runs =
      clock_ && now - *clock_ <= options_.silent / 2;  // both ended at about the same time
  return fmt::format("no odometry for {:.2f} s{}; {}", to_seconds(now - *heard_),
                     drives ? ": zero is sent until it comes again" : "",
                     clock_runs ? "the simulation publishes its clock: is it paused?"
                                : "nothing says that the simulation still runs");
}

}  // namespace waymark

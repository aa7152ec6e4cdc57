#include "waymark/robots/process/command_repeat.hpp"

#include <algorithm>
#include <cmath>

namespace waymark {

void CommandRepeat::offer(const VelocityCommand& command, Duration now) {
  const bool finite = std::isfinite(command.speed_m_s) && std::isfinite(command.yaw_rate_rad_s);
  command_ = finite ? command : VelocityCommand{};
  given_ = now;
  fresh_ = true;
}

std::optional<VelocityCommand> CommandRepeat::due(Duration now) {
  if (now - given_ > options_.timeout) command_ = {};
  if (!fresh_ && published_ && now - *published_ < options_.period) return std::nullopt;
  fresh_ = false;
  published_ = now;
  return command_;
}

Duration CommandRepeat::wait(Duration now) const {
  if (fresh_ || !published_) return Duration(0);
  return std::clamp(*published_ + options_.period - now, Duration(0), options_.period);
}

}  // namespace waymark

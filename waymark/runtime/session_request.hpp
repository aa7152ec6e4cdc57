#pragma once

#include <functional>
#include <optional>
#include <string>

#include "waymark/base/time.hpp"

namespace waymark {

/// What people beside the driver want of a session: viewers, whoever presses the space bar.
struct SessionRequest {
  bool end = false;
  std::string reason{};         ///< why it ends
  bool stand = false;           ///< zero is sent, whatever the driver decides
  std::optional<bool> pause{};  ///< of a replay, when it changed: pause, or resume
};

/// Asked before each decision.
using SessionRequests = std::function<SessionRequest(Duration uptime)>;

[[nodiscard]] inline SessionRequests no_requests() {
  return [](Duration) { return SessionRequest{}; };
}

}  // namespace waymark

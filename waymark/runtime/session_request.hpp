#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/localization/method.hpp"

namespace waymark {

/// What people beside the driver want of a session: viewers, whoever presses the space bar.
struct SessionRequest {
  bool end = false;
  std::string reason{};         ///< why it ends
  bool command_zero = false;    ///< zero is sent, whatever the driver decides
  std::optional<bool> pause{};  ///< of a replay, when it changed: pause, or resume
  /// Somebody says where the robot is: a replay stands until it is resumed.
  std::optional<GivenPose> pose{};
  std::vector<std::string> words{};  ///< for whoever runs the program
};

/// Asked before each decision.
using SessionRequests = std::function<SessionRequest(Duration uptime)>;

[[nodiscard]] inline SessionRequests no_requests() {
  return [](Duration) { return SessionRequest{}; };
}

}  // namespace waymark

#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/localization/method.hpp"

namespace waymark {

/// Requests to a session from outside the driver: viewers, the space bar.
struct SessionRequest {
  bool end = false;
  std::string reason{};         ///< why the session ends
  bool command_zero = false;    ///< whether to send zero, regardless of the driver's decision
  std::optional<bool> pause{};  ///< whether a replay should pause (true) or resume (false), if this has
                                ///< changed
  /// A pose set for the robot, after which a replay remains stopped until it is resumed.
  std::optional<GivenPose> pose{};
  std::vector<std::string> messages{};  ///< messages for the person who runs the program
};

/// Called before each decision.
using SessionRequests = std::function<SessionRequest(Duration uptime)>;

[[nodiscard]] inline SessionRequests no_requests() {
  return [](Duration) { return SessionRequest{}; };
}

}  // namespace waymark

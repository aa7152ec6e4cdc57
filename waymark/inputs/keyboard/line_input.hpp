#pragma once

#include <optional>
#include <string>

#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/runtime/operator_input.hpp"

namespace waymark {

/// An operator that is a program. It writes lines such as "go", "stop", "quit", "drive 0.3 -0.1" (m/s,
/// rad/s); the end of the input ends the session. A drive command ends after half a second, or on "go" or
/// "stop".
class LineInput final : public OperatorInput {
 public:
  /// Makes the descriptor non-blocking; the caller keeps ownership.
  explicit LineInput(int descriptor);

  Result<OperatorRequest> read(Duration uptime, SensorTime now, OperatorState state) override;
  [[nodiscard]] std::string usage() const override {
    return "lines: go, stop, quit, drive SPEED_M_S YAW_RATE_RAD_S";
  }
  [[nodiscard]] OperatorButtons buttons(OperatorState /*state*/) const override {
    return {"'go'", "'stop'", "'drive SPEED_M_S YAW_RATE_RAD_S' at least twice a second to drive"};
  }

 private:
  void apply_line(const std::string& line, Duration uptime, OperatorState state, OperatorRequest& request);

  int descriptor_;
  LineSplitter lines_{1024};
  VelocityCommand command_{};
  std::optional<Duration> commanded_at_{};
};

}  // namespace waymark

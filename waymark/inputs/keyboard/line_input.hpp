#pragma once

#include <optional>
#include <string>

#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/runtime/operator_input.hpp"

namespace waymark {

/// A program as the operator: "go", "stop", "quit", "drive 0.3 -0.1" (metres a second, radians a second), a
/// line each. Its end ends the session; when it is silent for half a second, and with "go" and "stop",
/// what it said before drives no more.
class LineInput final : public OperatorInput {
 public:
  /// The descriptor is read without waiting, and stays the caller's.
  explicit LineInput(int descriptor);

  Result<OperatorRequest> read(Duration uptime, SensorTime now, OperatorState state) override;
  [[nodiscard]] std::string usage() const override {
    return "lines: go, stop, quit, drive SPEED_M_S YAW_RATE_RAD_S";
  }
  [[nodiscard]] OperatorButtons buttons(OperatorState /*state*/) const override {
    return {"'go'", "'stop'", "'drive SPEED_M_S YAW_RATE_RAD_S' twice a second and more drives"};
  }

 private:
  void obey(const std::string& line, Duration uptime, OperatorState state, OperatorRequest& request);

  int descriptor_;
  LineSplitter lines_{1024};
  VelocityCommand command_{};
  std::optional<Duration> commanded_at_{};
};

}  // namespace waymark

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/localization/method.hpp"
#include "waymark/pipeline/operator.hpp"

namespace waymark {

/// What the operator asks for at this moment.
struct OperatorRequest {
  std::vector<OperatorEvent> events{};
  VelocityCommand command{};          ///< of sticks or keys, whatever the state makes of it
  std::optional<GamepadState> pad{};  ///< a sample like any other
  std::vector<std::string> words{};   ///< for the operator: what was not understood
  std::optional<GivenPose> pose{};    ///< of SessionRequest
};

/// Where the operator's buttons and sticks are: a gamepad, a keyboard, lines of a program, a page, a script.
class OperatorInput {
 public:
  virtual ~OperatorInput() = default;
  OperatorInput(const OperatorInput&) = delete;
  OperatorInput& operator=(const OperatorInput&) = delete;

  /// Asked twenty times a second; never waits. An error ends the session.
  [[nodiscard]] virtual Result<OperatorRequest> read(Duration uptime, SensorTime now,
                                                     OperatorState state) = 0;
  /// Every sample of the robot: a script follows the truth.
  virtual void receive(const Sample& /*sample*/) {}
  /// How to use it, in one line.
  [[nodiscard]] virtual std::string usage() const = 0;
  /// What its buttons are called.
  [[nodiscard]] virtual OperatorButtons buttons(OperatorState /*state*/) const { return {}; }
  /// Whether a person uses it, who sees the robot.
  [[nodiscard]] virtual bool is_person() const { return true; }
  /// Whether the keys of the page drive while teaching.
  [[nodiscard]] virtual bool page_drives() const { return false; }
  /// Whether a script could drive the lap now.
  [[nodiscard]] virtual bool has_script() const { return false; }

 protected:
  OperatorInput() = default;
};

}  // namespace waymark

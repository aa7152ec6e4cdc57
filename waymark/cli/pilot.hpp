#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/drivers/gamepad/gamepad.hpp"
#include "waymark/drivers/simulated/simulated_lap.hpp"
#include "waymark/pipeline/operator.hpp"

namespace waymark {
class LiveFeed;
}

namespace waymark::cli {

/// What a pilot does at this moment.
struct PilotAct {
  std::vector<OperatorEvent> events{};
  VelocityCommand command{};  ///< what the hands ask for, whatever the story makes of it
  std::optional<GamepadState> pad{};
  std::vector<std::string> words{};  ///< for whoever is in charge: what was not understood
};

/// Who runs the operator's story: a person with a gamepad or at the keys, a program that writes lines, or a
/// script that knows the way.
class Pilot {
 public:
  /// "gamepad", "keyboard", "lines", "scripted", or, with a `feed`, "page". With a feed the page has the
  /// buttons as well, and a script does not end the story.
  static Result<std::unique_ptr<Pilot>> make(const std::string& name, double speed_m_s,
                                             const SimulatedStage& stage, LiveFeed* feed = nullptr);
  virtual ~Pilot() = default;
  Pilot(const Pilot&) = delete;
  Pilot& operator=(const Pilot&) = delete;

  virtual Result<PilotAct> act(Duration uptime, SensorTime now, OperatorState state) = 0;
  /// The script looks at the truth.
  virtual void hear(const Sample& /*sample*/) {}
  /// How to do it, in one line.
  [[nodiscard]] virtual std::string usage() const = 0;
  /// What its buttons are called.
  [[nodiscard]] virtual OperatorButtons buttons() const { return {}; }
  /// Somebody stands at the robot, or sits at the keys.
  [[nodiscard]] virtual bool is_person() const { return true; }
  /// While teaching the keys of the page drive.
  [[nodiscard]] virtual bool page_drives() const { return false; }
  /// A script could drive the lap now, if somebody asks for it.
  [[nodiscard]] virtual bool has_script() const { return false; }

 protected:
  Pilot() = default;
};

[[nodiscard]] std::vector<std::string> pilots();

/// A person with this pad in hand.
[[nodiscard]] std::unique_ptr<Pilot> pilot_with_pad(std::unique_ptr<Gamepad> pad, double speed_m_s);

}  // namespace waymark::cli

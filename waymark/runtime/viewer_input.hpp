#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/localization/method.hpp"
#include "waymark/pipeline/operator.hpp"
#include "waymark/runtime/operator_input.hpp"
#include "waymark/runtime/session_request.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// What a viewer asks for.
struct ViewerOrder {
  /// SetControl, Snapshot and Record are for a camera that is shown without a robot; Words are a sentence for
  /// whoever runs the program.
  enum class Kind : std::uint8_t {
    Go,
    Stop,
    Quit,
    Script,
    Velocity,
    GivePose,
    Words,
    SetControl,
    Snapshot,
    Record,
    Teach
  };
  Kind kind = Kind::Stop;
  VelocityCommand command{};  ///< of Velocity
  std::string control{};      ///< of SetControl: which, in the words of CameraControl
  double value = 0;           ///< of SetControl
  GivenPose pose{};           ///< of GivePose
  std::string words{};        ///< of Words
};

/// Whether a viewer holds control, or held it and went away without giving it back.
enum class ViewerControl : std::uint8_t { Nobody, Held, Lost };

/// What an operator is told of the buttons that viewers have.
struct ViewerWords {
  std::string alone = "the page has the buttons";
  std::string beside = "the page has the same buttons";
  std::string stopped = "stopped on the page";
  std::function<OperatorButtons(OperatorState)> buttons = [](OperatorState) {
    return OperatorButtons{"'go'", "'stop'", "take control and drive"};
  };
};

/// Where viewers' orders come from.
struct ViewerLink {
  /// What was asked for since the last call, oldest first.
  std::function<std::vector<ViewerOrder>()> take_orders = [] { return std::vector<ViewerOrder>(); };
  std::function<ViewerControl()> control = [] { return ViewerControl::Nobody; };
  ViewerWords words{};
};

/// What viewers ask for, turned into events and commands; and what happens when the one in control goes away:
/// while teaching the robot stands until somebody takes over, a replay pauses.
class ViewerRequests {
 public:
  explicit ViewerRequests(ViewerLink link) : link_(std::move(link)) {}

  struct Request {
    std::vector<OperatorEvent> events{};
    std::optional<VelocityCommand> drive{};  ///< a viewer drives with the keys of the page
    bool script = false;                     ///< a viewer asked for the script
    bool command_zero = false;               ///< zero, whatever others want
    std::optional<GivenPose> pose{};         ///< a viewer says where the robot is
    std::vector<std::string> words{};        ///< for whoever runs the program
  };
  [[nodiscard]] Request read(Duration uptime, OperatorState state);
  /// A person at the robot pressed something, so the robot is watched.
  void driver_is_present() { command_zero_ = false; }
  [[nodiscard]] const ViewerWords& words() const { return link_.words; }

 private:
  void notice_control(ViewerControl control, Duration uptime, OperatorState state);
  void apply_order(const ViewerOrder& order, Duration uptime, OperatorState state, Request& request);

  ViewerLink link_;
  ViewerControl before_ = ViewerControl::Nobody;
  VelocityCommand command_{};
  std::optional<Duration> commanded_at_{};
  bool command_zero_ = false;
  bool pause_ = false;
  Duration pause_asked_{};
};

/// Another input, and the page beside it. Without another the page alone decides; a script drives a taught
/// lap on request, where one knows the way.
class ViewerInput final : public OperatorInput {
 public:
  /// Makes a driver that stands where the lap begins; nullptr where nobody knows the way.
  using MakeScript = std::function<std::unique_ptr<LapDriver>()>;
  ViewerInput(ViewerLink link, std::unique_ptr<OperatorInput> other, MakeScript make_script)
      : requests_(std::move(link)),
        other_(std::move(other)),
        make_script_(std::move(make_script)),
        script_(make_script_()) {}

  Result<OperatorRequest> read(Duration uptime, SensorTime now, OperatorState state) override;
  void receive(const Sample& sample) override;
  [[nodiscard]] std::string usage() const override;
  [[nodiscard]] OperatorButtons buttons(OperatorState state) const override {
    return other_ ? other_->buttons(state) : requests_.words().buttons(state);
  }
  [[nodiscard]] bool page_drives() const override { return other_ == nullptr; }
  [[nodiscard]] bool has_script() const override {
    return script_ != nullptr && truth_received_ && !scripting_;
  }

 private:
  ViewerRequests requests_;
  std::unique_ptr<OperatorInput> other_;
  MakeScript make_script_;
  std::unique_ptr<LapDriver> script_;
  bool scripting_ = false;
  bool script_used_ = false;
  bool truth_received_ = false;  ///< a script follows the truth
};

/// The viewers of a session that is one state of the operator's: a lap that is taught, a replay. Go pauses a
/// replay and ends a lap.
class PhaseRequests {
 public:
  /// `stop_pressed`: the space bar. Without a link nothing comes from viewers.
  PhaseRequests(std::optional<ViewerLink> link, OperatorState phase, std::function<bool()> stop_pressed)
      : phase_(phase), stop_pressed_(std::move(stop_pressed)) {
    if (link) requests_.emplace(std::move(*link));
  }

  [[nodiscard]] SessionRequest read(Duration uptime);
  /// A replay may be paused.
  [[nodiscard]] OperatorState phase() const { return phase_; }

 private:
  std::optional<ViewerRequests> requests_{};
  OperatorState phase_;
  std::function<bool()> stop_pressed_;
};

/// The orders that mean something in this state: "go", "stop", "script", "teach", "quit".
[[nodiscard]] std::vector<std::string> viewer_commands(OperatorState state, bool has_script);

}  // namespace waymark

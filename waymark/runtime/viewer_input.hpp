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

/// An order of a viewer.
struct ViewerOrder {
  /// SetControl, Snapshot and Record are for a camera that is shown without a robot. Message is for the
  /// person who runs the program.
  enum class Kind : std::uint8_t {
    Go,
    Stop,
    Quit,
    Script,
    Velocity,
    GivePose,
    Message,
    SetControl,
    Snapshot,
    Record,
    Teach
  };
  Kind kind = Kind::Stop;
  VelocityCommand command{};  ///< of Velocity
  std::string control{};      ///< of SetControl: name of the control, as in CameraControl
  double value = 0;           ///< of SetControl
  GivenPose pose{};           ///< of GivePose
  std::string message{};      ///< of Message
};

/// Whether a viewer holds control, or left without releasing it.
enum class ViewerControl : std::uint8_t { None, Held, Lost };

/// Texts for the operator about the buttons of viewers.
struct ViewerLabels {
  std::string alone = "the page has the buttons";
  std::string beside = "the page has the same buttons";
  std::string stopped = "stopped on the page";
  std::function<OperatorButtons(OperatorState)> buttons = [](OperatorState) {
    return OperatorButtons{"'go'", "'stop'", "take control and drive"};
  };
};

/// Source of viewers' orders.
struct ViewerLink {
  /// Orders since the last call, oldest first.
  std::function<std::vector<ViewerOrder>()> take_orders = [] { return std::vector<ViewerOrder>(); };
  std::function<ViewerControl()> control = [] { return ViewerControl::None; };
  ViewerLabels labels{};
};

/// Converts viewers' orders to events and commands. If the viewer in control leaves, a taught robot stops
/// until another person takes over, and a replay pauses.
class ViewerRequests {
 public:
  explicit ViewerRequests(ViewerLink link) : link_(std::move(link)) {}

  struct Request {
    std::vector<OperatorEvent> events{};
    std::optional<VelocityCommand> drive{};  ///< a viewer drives with the keys of the page
    bool script = false;                     ///< a viewer requested the script
    bool command_zero = false;               ///< zero, regardless of other inputs
    std::optional<GivenPose> pose{};         ///< given by a viewer
    std::vector<std::string> messages{};     ///< for the person who runs the program
  };
  [[nodiscard]] Request read(Duration uptime, OperatorState state);
  /// A person at the robot pressed a button, so the robot is attended.
  void driver_is_present() { command_zero_ = false; }
  [[nodiscard]] const ViewerLabels& labels() const { return link_.labels; }

 private:
  void notice_control(ViewerControl control, Duration uptime, OperatorState state);
  void apply_order(const ViewerOrder& order, Duration uptime, OperatorState state, Request& request);

  ViewerLink link_;
  ViewerControl before_ = ViewerControl::None;
  VelocityCommand command_{};
  std::optional<Duration> commanded_at_{};
  bool command_zero_ = false;
  bool pause_ = false;
  Duration pause_asked_{};
};

/// The page, alone or in addition to another input. A script drives a taught lap on request, if there is one.
class ViewerInput final : public OperatorInput {
 public:
  /// Creates a driver for the start of the lap; nullptr if there is no script.
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
    return other_ ? other_->buttons(state) : requests_.labels().buttons(state);
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
  bool truth_received_ = false;  ///< a script requires the ground truth
};

/// Viewers of a session that has only one state of the operator's session: a taught lap or a replay. Go
/// pauses a replay and ends a lap.
class PhaseRequests {
 public:
  /// `stop_pressed`: the space bar. Without a link there are no viewers.
  PhaseRequests(std::optional<ViewerLink> link, OperatorState phase, std::function<bool()> stop_pressed)
      : phase_(phase), stop_pressed_(std::move(stop_pressed)) {
    if (link) requests_.emplace(std::move(*link));
  }

  [[nodiscard]] SessionRequest read(Duration uptime);
  /// The phase with the pause of a replay.
  [[nodiscard]] OperatorState phase() const { return phase_; }

 private:
  std::optional<ViewerRequests> requests_{};
  OperatorState phase_;
  std::function<bool()> stop_pressed_;
};

/// The orders that have an effect in this state: "go", "stop", "script", "teach", "quit".
[[nodiscard]] std::vector<std::string> viewer_commands(OperatorState state, bool has_script);

}  // namespace waymark

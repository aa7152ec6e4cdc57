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

/// An order from a viewer.
struct ViewerOrder {
  /// SetControl, Snapshot and Record apply to a camera that is shown without a robot. Message is shown to the
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
  VelocityCommand command{};  ///< command for Velocity
  std::string control{};      ///< name of the control for SetControl, as in CameraControl
  double value = 0;           ///< value for SetControl
  GivenPose pose{};           ///< pose for GivePose
  std::string message{};      ///< text for Message
};

/// Whether a viewer is in control, or has left without releasing control.
enum class ViewerControl : std::uint8_t { None, Held, Lost };

/// What messages to the operator call the viewers' buttons.
struct ViewerLabels {
  std::string alone = "the page has the buttons";
  std::string beside = "the page has the same buttons";
  std::string stopped = "stopped on the page";
  std::function<OperatorButtons(OperatorState)> buttons = [](OperatorState) {
    return OperatorButtons{"'go'", "'stop'", "take control and drive"};
  };
};

/// The source of orders from viewers.
struct ViewerLink {
  /// Returns the orders since the last call, oldest first.
  std::function<std::vector<ViewerOrder>()> take_orders = [] { return std::vector<ViewerOrder>(); };
  std::function<ViewerControl()> control = [] { return ViewerControl::None; };
  ViewerLabels labels{};
};

/// Converts orders from viewers to events and commands. If the viewer in control leaves, a robot that is
/// being taught stops until another person takes over, and a replay pauses.
class ViewerRequests {
 public:
  explicit ViewerRequests(ViewerLink link) : link_(std::move(link)) {}

  struct Request {
    std::vector<OperatorEvent> events{};
    std::optional<VelocityCommand> drive{};  ///< command from a viewer who drives with the keys of the page
    bool script = false;                     ///< whether a viewer requested the script
    bool command_zero = false;               ///< whether to send zero, regardless of other inputs
    std::optional<GivenPose> pose{};         ///< pose set by a viewer
    std::vector<std::string> messages{};     ///< messages for the person who runs the program
  };
  [[nodiscard]] Request read(Duration uptime, OperatorState state);
  /// Call when a person at the robot presses a button, which shows that the robot is attended.
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

/// The page, either alone or in addition to another input. If there is a script, it can be asked to drive the
/// lap to be taught.
class ViewerInput final : public OperatorInput {
 public:
  /// Creates a driver at the start of the lap; returns nullptr if there is no script.
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
  bool truth_received_ = false;  ///< whether ground truth has been received, which a script requires
};

/// Handles viewers of a session that consists of a single phase, either teaching a lap or a replay. Go pauses
/// a replay and ends a lap.
class PhaseRequests {
 public:
  /// `stop_pressed` reports the space bar. Without a link there are no viewers.
  PhaseRequests(std::optional<ViewerLink> link, OperatorState phase, std::function<bool()> stop_pressed)
      : phase_(phase), stop_pressed_(std::move(stop_pressed)) {
    if (link) requests_.emplace(std::move(*link));
  }

  [[nodiscard]] SessionRequest read(Duration uptime);
  /// The phase, which also shows whether a replay is paused.
  [[nodiscard]] OperatorState phase() const { return phase_; }

 private:
  std::optional<ViewerRequests> requests_{};
  OperatorState phase_;
  std::function<bool()> stop_pressed_;
};

/// The orders that have an effect in this state, out of "go", "stop", "script", "teach", "quit".
[[nodiscard]] std::vector<std::string> viewer_commands(OperatorState state, bool has_script);

}  // namespace waymark

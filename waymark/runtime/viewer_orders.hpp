#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "waymark/localization/method.hpp"
#include "waymark/pipeline/operator.hpp"
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

}  // namespace waymark

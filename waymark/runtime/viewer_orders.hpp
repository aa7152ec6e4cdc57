#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// What a viewer asks for.
struct ViewerOrder {
  enum class Kind : std::uint8_t { Go, Stop, Quit, Script, Velocity };
  Kind kind = Kind::Stop;
  VelocityCommand command{};  ///< of Velocity
};

/// Whether a viewer holds control, or held it and went away without giving it back.
enum class ViewerControl : std::uint8_t { Nobody, Held, Lost };

/// Where viewers' orders come from.
struct ViewerLink {
  /// What was asked for since the last call, oldest first.
  std::function<std::vector<ViewerOrder>()> take_orders = [] { return std::vector<ViewerOrder>(); };
  std::function<ViewerControl()> control = [] { return ViewerControl::Nobody; };
};

}  // namespace waymark

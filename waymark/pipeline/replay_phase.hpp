#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// How a replay follows its route.
enum class ReplayController : std::uint8_t {
  Follower,  ///< curvature fed forward, errors fed back
  Pursuit,   ///< pure pursuit
  Pose,      ///< from goal to goal
};

/// The names of the controllers: follower, pursuit, pose.
[[nodiscard]] std::vector<std::string> replay_controllers();
[[nodiscard]] std::string_view to_string(ReplayController controller);
/// Fails (InvalidArgument, with a suggestion) on a name that is none of replay_controllers().
[[nodiscard]] Result<ReplayController> parse_controller(std::string_view name);

enum class ReplayState : std::uint8_t {
  Waiting,     ///< for the first estimate
  Refused,     ///< the start gate is shut
  Driving,     ///< along the route
  AtStation,   ///< stands where the route says so, and continues when the dwell time is over
  Stopped,     ///< by the limiter; continues when the reason is gone, a lasting reason ends with Resume
  Finished,    ///< the whole route was driven
  Incomplete,  ///< at the end of the route, but not all of it was driven
};

/// What one step of a replay finds, in the order in which a step looks.
enum class ReplayEvent : std::uint8_t {
  GateOpen,        ///< near the route and pointing along it
  GateShut,        ///< too far from the route, or pointing away
  GoalReached,     ///< at the end of the route, or of its last lap, and all of it was driven
  EndReached,      ///< at the end, but a part of the route was left out
  LimiterStops,    ///< there is a reason to stop
  LimiterAllows,   ///< there is none, and no station is being served
  StationReached,  ///< there is none, and a station is being served
  Resume,          ///< a person asks to continue
};

enum class ReplayAction : std::uint8_t {
  Nothing,
  BeginRoute,  ///< stations count from here
  CountStop,   ///< one stop more
};

struct ReplayTransition {
  ReplayState to = ReplayState::Waiting;
  ReplayAction action = ReplayAction::Nothing;

  friend bool operator==(const ReplayTransition&, const ReplayTransition&) = default;
};

/// The replay phase as a table: what each event does in each state; nothing where it does nothing. Pure.
[[nodiscard]] std::optional<ReplayTransition> transition(ReplayState from, ReplayEvent event);

/// Whether commands may be sent at all: not once it is refused or over.
[[nodiscard]] constexpr bool is_live(ReplayState state) {
  return state != ReplayState::Refused && state != ReplayState::Finished && state != ReplayState::Incomplete;
}

/// "driving", "stopped", …
[[nodiscard]] std::string_view to_string(ReplayState state);
[[nodiscard]] std::string_view to_string(ReplayEvent event);

}  // namespace waymark

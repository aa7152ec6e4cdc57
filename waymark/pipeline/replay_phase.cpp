#include "waymark/pipeline/replay_phase.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

using State = ReplayState;
using Event = ReplayEvent;
using Action = ReplayAction;

struct Row {
  State from;
  Event event;
  ReplayTransition then;
};

/// Everything that can happen; docs/concepts/replay.md draws it. What is not here changes nothing.
constexpr std::array kReplayTable{
    Row{State::Waiting, Event::GateOpen, {State::Driving, Action::BeginRoute}},
    Row{State::Waiting, Event::GateShut, {State::Refused, Action::Nothing}},
    Row{State::Refused, Event::Resume, {State::Waiting, Action::Nothing}},
    Row{State::Driving, Event::GateShut, {State::Refused, Action::Nothing}},
    Row{State::Driving, Event::GoalReached, {State::Finished, Action::Nothing}},
    Row{State::Driving, Event::EndReached, {State::Incomplete, Action::Nothing}},
    Row{State::Driving, Event::LimiterStops, {State::Stopped, Action::CountStop}},
    Row{State::Driving, Event::StationReached, {State::AtStation, Action::Nothing}},
    Row{State::AtStation, Event::GateShut, {State::Refused, Action::Nothing}},
    Row{State::AtStation, Event::LimiterStops, {State::Stopped, Action::CountStop}},
    Row{State::AtStation, Event::LimiterAllows, {State::Driving, Action::Nothing}},
    Row{State::Stopped, Event::GateShut, {State::Refused, Action::Nothing}},
    Row{State::Stopped, Event::LimiterAllows, {State::Driving, Action::Nothing}},
    Row{State::Stopped, Event::StationReached, {State::AtStation, Action::Nothing}},
};

constexpr std::array<std::string_view, 3> kControllers{"follower", "pursuit", "pose"};

}  // namespace

std::vector<std::string> replay_controllers() { return {kControllers.begin(), kControllers.end()}; }

std::string_view to_string(ReplayController controller) {
  return kControllers[static_cast<std::size_t>(controller)];
}

Result<ReplayController> parse_controller(std::string_view name) {
  const auto* const found = std::ranges::find(kControllers, name);
  if (found != kControllers.end()) return static_cast<ReplayController>(found - kControllers.begin());
  return fail(ErrorCode::InvalidArgument, fmt::format("there is no controller '{}'", name), {},
              suggestion(std::string(name), replay_controllers()));
}

std::optional<ReplayTransition> transition(ReplayState from, ReplayEvent event) {
  const auto* const row =
      std::ranges::find_if(kReplayTable, [&](const Row& r) { return r.from == from && r.event == event; });
  return row != kReplayTable.end() ? std::optional(row->then) : std::nullopt;
}

std::string_view to_string(ReplayState state) {
  constexpr std::array<std::string_view, 7> kWords{"waiting", "refused",  "driving",   "at a station",
                                                   "stopped", "finished", "incomplete"};
  return kWords[static_cast<std::size_t>(state)];
}

std::string_view to_string(ReplayEvent event) {
  constexpr std::array<std::string_view, 8> kWords{"gate open",       "gate shut",     "goal reached",
                                                   "end reached",     "limiter stops", "limiter allows",
                                                   "station reached", "resume"};
  return kWords[static_cast<std::size_t>(event)];
}

}  // namespace waymark

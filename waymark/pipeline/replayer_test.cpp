#include "waymark/pipeline/replayer.hpp"

#include <array>
#include <map>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using State = ReplayState;
using Event = ReplayEvent;
using Action = ReplayAction;

constexpr std::array kReplayStates{State::Waiting, State::Refused,  State::Driving,   State::AtStation,
                                   State::Stopped, State::Finished, State::Incomplete};
constexpr std::array kReplayEvents{Event::GateOpen,       Event::GateShut,     Event::GoalReached,
                                   Event::EndReached,     Event::LimiterStops, Event::LimiterAllows,
                                   Event::StationReached, Event::Resume};

// Tests every combination of seven states and eight events; only the transitions listed here exist.
TEST(ReplayPhase, EveryCellOfTheTable) {
  const std::map<std::pair<State, Event>, ReplayTransition> expected = {
      {{State::Waiting, Event::GateOpen}, {State::Driving, Action::BeginRoute}},
      {{State::Waiting, Event::GateShut}, {State::Refused}},
      {{State::Refused, Event::Resume}, {State::Waiting}},
      {{State::Driving, Event::GateShut}, {State::Refused}},
      {{State::Driving, Event::GoalReached}, {State::Finished}},
      {{State::Driving, Event::EndReached}, {State::Incomplete}},
      {{State::Driving, Event::LimiterStops}, {State::Stopped, Action::CountStop}},
      {{State::Driving, Event::StationReached}, {State::AtStation}},
      {{State::AtStation, Event::GateShut}, {State::Refused}},
      {{State::AtStation, Event::LimiterStops}, {State::Stopped, Action::CountStop}},
      {{State::AtStation, Event::LimiterAllows}, {State::Driving}},
      {{State::Stopped, Event::GateShut}, {State::Refused}},
      {{State::Stopped, Event::LimiterAllows}, {State::Driving}},
      {{State::Stopped, Event::StationReached}, {State::AtStation}},
  };
  for (const State state : kReplayStates) {
    for (const Event event : kReplayEvents) {
      const auto cell = expected.find({state, event});
      const std::optional<ReplayTransition> then = transition(state, event);
      ASSERT_EQ(then.has_value(), cell != expected.end()) << to_string(state) << ", " << to_string(event);
      if (then) EXPECT_EQ(*then, cell->second) << to_string(state) << ", " << to_string(event);
    }
  }
}

// No event leaves Finished, only Resume leaves Refused, and only the start gate leaves Waiting.
TEST(ReplayPhase, AFinishedOrRefusedReplayDoesNotMove) {
  for (const Event event : kReplayEvents) {
    EXPECT_FALSE(transition(State::Finished, event)) << to_string(event);
    EXPECT_FALSE(transition(State::Incomplete, event)) << to_string(event);
    if (event != Event::Resume) EXPECT_FALSE(transition(State::Refused, event)) << to_string(event);
  }
  EXPECT_FALSE(is_live(State::Finished));
  EXPECT_FALSE(is_live(State::Refused));
  EXPECT_FALSE(is_live(State::Incomplete));
  EXPECT_TRUE(is_live(State::Stopped));
}

TEST(ReplayController, AnUnknownNameIsAnError) {
  for (const std::string& name : replay_controllers())
    EXPECT_EQ(to_string(parse_controller(name).value()), name);
  const auto unknown = parse_controller("persuit");
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().hint, ::testing::HasSubstr("pursuit"));
  testing::expect_on_page("replay", unknown.error());
}

}  // namespace
}  // namespace waymark

#include "waymark/pipeline/operator.hpp"

#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using S = OperatorState;
using E = OperatorEvent;
using A = OperatorAction;

constexpr std::array kStates{S::Idle,   S::Teaching, S::Mapping, S::Ready, S::Replaying,
                             S::Paused, S::Done,     S::Stopped, S::Over};
constexpr std::array kEvents{E::Go,        E::Stop,           E::StickMoved,    E::MapMade,
                             E::MapFailed, E::ReplayFinished, E::ReplayStopped, E::Teach,
                             E::Quit};
constexpr VelocityCommand kPerson{0.3, 0.1};
constexpr VelocityCommand kReplay{0.2, -0.1};

TEST(Operator, ASessionFromIdleToDone) {
  Operator session;
  Duration now{};
  const auto then = [&](E event) { return session.handle(event, now += seconds(1)).value(); };
  EXPECT_EQ(then(E::Go), A::StartLap);
  EXPECT_EQ(then(E::StickMoved), A::Nothing);
  EXPECT_EQ(then(E::Go), A::FinishLap);
  EXPECT_EQ(session.state(), S::Mapping);
  EXPECT_EQ(session.since(), now);
  EXPECT_EQ(then(E::MapMade), A::Nothing);
  EXPECT_EQ(then(E::Go), A::StartReplay);
  EXPECT_EQ(then(E::Go), A::PauseReplay);
  EXPECT_EQ(then(E::Go), A::ResumeReplay);
  EXPECT_EQ(then(E::ReplayFinished), A::EndReplay);
  EXPECT_EQ(session.state(), S::Done);
  EXPECT_EQ(session.reason(), "");
  EXPECT_EQ(then(E::Go), A::StartReplay) << "a second replay";
  EXPECT_EQ(then(E::StickMoved), A::EndReplay);
  EXPECT_EQ(session.state(), S::Stopped);
  EXPECT_EQ(session.reason(), "stopped: a stick was moved");
  EXPECT_EQ(then(E::Quit), A::Leave);
}

TEST(Operator, EveryTransitionAndEveryRefusal) {
  // An independent copy of the table, with state, event and result.
  const std::map<std::pair<S, E>, std::pair<S, A>> expected = {
      {{S::Idle, E::Go}, {S::Teaching, A::StartLap}},
      {{S::Idle, E::Teach}, {S::Teaching, A::StartLap}},
      {{S::Ready, E::Teach}, {S::Teaching, A::StartLap}},
      {{S::Done, E::Teach}, {S::Teaching, A::StartLap}},
      {{S::Stopped, E::Teach}, {S::Teaching, A::StartLap}},
      {{S::Teaching, E::Go}, {S::Mapping, A::FinishLap}},
      {{S::Teaching, E::Stop}, {S::Idle, A::DropLap}},
      {{S::Teaching, E::StickMoved}, {S::Teaching, A::Nothing}},
      {{S::Mapping, E::MapMade}, {S::Ready, A::Nothing}},
      {{S::Mapping, E::MapFailed}, {S::Idle, A::Nothing}},
      {{S::Ready, E::Go}, {S::Replaying, A::StartReplay}},
      {{S::Replaying, E::Go}, {S::Paused, A::PauseReplay}},
      {{S::Replaying, E::Stop}, {S::Stopped, A::EndReplay}},
      {{S::Replaying, E::StickMoved}, {S::Stopped, A::EndReplay}},
      {{S::Replaying, E::ReplayFinished}, {S::Done, A::EndReplay}},
      {{S::Replaying, E::ReplayStopped}, {S::Stopped, A::EndReplay}},
      {{S::Paused, E::Go}, {S::Replaying, A::ResumeReplay}},
      {{S::Paused, E::Stop}, {S::Stopped, A::EndReplay}},
      {{S::Done, E::Go}, {S::Replaying, A::StartReplay}},
      {{S::Stopped, E::Go}, {S::Replaying, A::StartReplay}}};
  std::set<std::string> refusals;
  for (const S state : kStates) {
    for (const E event : kEvents) {
      Operator session({}, state);
      const auto action = session.handle(event, seconds(1), "why");
      const std::string where = std::string(to_string(state)) + ", " + std::string(to_string(event));
      const auto found = expected.find({state, event});
      if (event == E::Quit && state != S::Over) {
        EXPECT_EQ(action.value(), A::Leave) << where;
        EXPECT_EQ(session.state(), S::Over) << where;
      } else if (found != expected.end()) {
        ASSERT_TRUE(action) << where;
        EXPECT_EQ(*action, found->second.second) << where;
        EXPECT_EQ(session.state(), found->second.first) << where;
        EXPECT_EQ(session.reason(), session.state() == state ? "" : "why") << where;
      } else {
        ASSERT_FALSE(action) << where;
        EXPECT_EQ(session.state(), state) << where << ": a refused event does not change the state";
        EXPECT_GT(action.error().message.size(), 8U) << where;
        refusals.insert(action.error().message);
      }
    }
    EXPECT_EQ(Operator({}, state).prompt().empty(), state == S::Over);
  }
  std::string lines;
  for (const std::string& refusal : refusals) lines += refusal + "\n";
  testing::expect_on_page("session", lines);
}

TEST(Operator, CommandsPassOnlyWhileTeachingOrReplaying) {
  for (const S state : kStates) {
    const VelocityCommand sent = Operator({}, state).permit(kPerson, kReplay);
    EXPECT_EQ(sent, state == S::Teaching    ? kPerson
                    : state == S::Replaying ? kReplay
                                            : VelocityCommand{})
        << to_string(state);
  }
}

TEST(Operator, AStoppedRobotMovesOnlyAfterGoOrTeach) {
  Random random(20261122);
  for (int run = 0; run < 200; ++run) {
    Operator session;
    Duration now{};
    for (int i = 0; i < 200; ++i) {
      const bool could_move = session.permit(kPerson, kReplay) != VelocityCommand{};
      const E event = kEvents[random.index(kEvents.size() - 1)];  // any event except Quit
      (void)session.handle(event, now += milliseconds(400));
      const bool can_move = session.permit(kPerson, kReplay) != VelocityCommand{};
      ASSERT_TRUE(could_move || !can_move || event == E::Go || event == E::Teach)
          << "only Go and Teach start motion";
      ASSERT_TRUE(event != E::Stop || !can_move);
      ASSERT_TRUE(event != E::StickMoved || !can_move || session.state() == S::Teaching);
    }
  }
}

TEST(Operator, ABouncingButtonCountsOnce) {
  Operator session;
  ASSERT_TRUE(session.handle(E::Go, seconds(1)));
  EXPECT_FALSE(session.handle(E::Go, seconds(1) + milliseconds(299)));
  EXPECT_EQ(session.state(), S::Teaching);
  EXPECT_FALSE(session.handle(E::Go, seconds(1) + milliseconds(400)))
      << "within the time in which presses are ignored";
  EXPECT_TRUE(session.handle(E::Go, seconds(1) + milliseconds(700)));
}

TEST(OperatorPad, ButtonsCountOncePerPressAndSticksWhileDeflected) {
  OperatorPad pad;
  const auto state = [](int button, float stick) {
    GamepadState pad_state{.axes = {0, stick, 0, 0, 1, 1}, .buttons = std::vector<std::int32_t>(15, 0)};
    if (button >= 0) pad_state.buttons[static_cast<std::size_t>(button)] = 1;
    return pad_state;
  };
  EXPECT_FALSE(pad.add(state(3, 0))) << "held before the session began";
  EXPECT_FALSE(pad.add(state(3, 0)));
  EXPECT_FALSE(pad.add(state(-1, 0.29F)));
  EXPECT_EQ(pad.add(state(3, 0)), E::Go);
  EXPECT_FALSE(pad.add(state(3, 0)));
  EXPECT_EQ(pad.add(state(1, 1)), E::Stop) << "Stop has priority over the stick";
  EXPECT_EQ(pad.add(state(1, 1)), E::StickMoved);
  EXPECT_EQ(pad.add(state(-1, -0.5F)), E::StickMoved);
  EXPECT_EQ(pad.add(state(-1, std::numeric_limits<float>::quiet_NaN())), E::StickMoved);
  EXPECT_EQ(pad.add(state(4, 0)), E::Quit);
  EXPECT_FALSE(pad.add(GamepadState{})) << "a gamepad without buttons and axes";
}

}  // namespace
}  // namespace waymark

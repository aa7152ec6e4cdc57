#include "waymark/runtime/viewer_input.hpp"

#include <algorithm>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using E = OperatorEvent;
using S = OperatorState;
using Control = ViewerControl;
using Kind = ViewerOrder::Kind;

constexpr Duration seconds(double value) { return Duration(static_cast<std::int64_t>(value * 1e9)); }

/// Simulates viewers with a list of orders and a control state.
struct FakeViewers {
  void order(const ViewerOrder& order) { orders.push_back(order); }
  void set_control(Control now) { control = now; }
  ViewerLink link() {
    return {.take_orders = [this] { return std::exchange(orders, {}); },
            .control = [this] { return control; }};
  }

  std::vector<ViewerOrder> orders{};
  Control control = Control::None;
};

class Orders : public ::testing::Test {
 protected:
  FakeViewers feed_;
  ViewerRequests orders_{feed_.link()};
};

TEST_F(Orders, AnOrderTakesEffectOnce) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Go});
  EXPECT_EQ(orders_.read(seconds(1), S::Idle).events, std::vector<E>{E::Go});
  EXPECT_TRUE(orders_.read(seconds(1.05), S::Teaching).events.empty());
}

TEST_F(Orders, AVelocityHoldsForHalfASecond) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Velocity, .command = {0.3, 0}});
  EXPECT_EQ(orders_.read(seconds(1), S::Teaching).drive, (VelocityCommand{0.3, 0}));
  EXPECT_EQ(orders_.read(seconds(1.5), S::Teaching).drive, (VelocityCommand{0.3, 0}));
  EXPECT_FALSE(orders_.read(seconds(1.51), S::Teaching).drive);
}

TEST_F(Orders, TheScriptTakesOverFromAReleasedKey) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Velocity, .command = {0.3, 0}});
  feed_.order({.kind = Kind::Velocity});
  EXPECT_EQ(orders_.read(seconds(1), S::Teaching).drive, VelocityCommand{});
  feed_.order({.kind = Kind::Script});
  const auto act = orders_.read(seconds(1.1), S::Teaching);
  EXPECT_TRUE(act.script);
  EXPECT_FALSE(act.drive);
  feed_.order({.kind = Kind::Velocity, .command = {0.1, 0}});
  EXPECT_TRUE(orders_.read(seconds(1.2), S::Teaching).drive);  // pressing a key takes over from the script
}

TEST_F(Orders, KeysStopAReplayLikeSticks) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Velocity, .command = {0.3, 0}});
  EXPECT_EQ(orders_.read(seconds(1), S::Replaying).events, std::vector<E>{E::StickMoved});
  feed_.order({.kind = Kind::Velocity});  // a key was released
  EXPECT_TRUE(orders_.read(seconds(2), S::Replaying).events.empty());
}

TEST_F(Orders, TheRobotStopsWhileTeachingUntilAPersonIsPresent) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Velocity, .command = {0.3, 0}});
  EXPECT_FALSE(orders_.read(seconds(1), S::Teaching).command_zero);
  feed_.set_control(Control::Lost);
  for (double t = 1.05; t < 5; t += 0.05) {
    const auto act = orders_.read(seconds(t), S::Teaching);
    EXPECT_TRUE(act.command_zero);
    EXPECT_FALSE(act.drive);
    EXPECT_TRUE(act.events.empty());
  }
  feed_.set_control(Control::Held);
  EXPECT_FALSE(orders_.read(seconds(5), S::Teaching).command_zero);
  feed_.set_control(Control::Lost);
  EXPECT_TRUE(orders_.read(seconds(6), S::Teaching).command_zero);
  orders_.driver_is_present();  // the button at the robot was pressed
  EXPECT_FALSE(orders_.read(seconds(7), S::Teaching).command_zero);
}

/// A previous press does not prevent this, although the session ignores a second press within 0.3 s.
TEST_F(Orders, AReplayPausesWhenItsViewerLeaves) {
  for (const double since_press : {0.05, 0.25, 0.5, 3.0}) {
    FakeViewers feed;
    ViewerRequests orders(feed.link());
    Operator session({}, S::Ready);
    feed.set_control(Control::Held);
    feed.order({.kind = Kind::Go});
    double t = 1;
    for (; t < 1 + since_press; t += 0.05) {
      for (const E event : orders.read(seconds(t), session.state()).events)
        (void)session.handle(event, seconds(t));
    }
    ASSERT_EQ(session.state(), S::Replaying);
    feed.set_control(Control::Lost);
    for (const double end = t + 1; t < end; t += 0.05) {
      for (const E event : orders.read(seconds(t), session.state()).events)
        (void)session.handle(event, seconds(t));
    }
    EXPECT_EQ(session.state(), S::Paused) << since_press;
    feed.set_control(Control::Held);  // the replay resumes on request
    feed.order({.kind = Kind::Go});
    for (const E event : orders.read(seconds(t), session.state()).events)
      (void)session.handle(event, seconds(t));
    EXPECT_EQ(session.state(), S::Replaying);
  }
}

TEST_F(Orders, OrdersOfALostViewerOnlyStop) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Go});
  feed_.order({.kind = Kind::Stop});
  feed_.set_control(Control::Lost);
  EXPECT_EQ(orders_.read(seconds(1), S::Ready).events, std::vector<E>{E::Stop});
}

TEST_F(Orders, ReleasingControlHasNoEffect) {
  feed_.set_control(Control::Held);
  (void)orders_.read(seconds(1), S::Replaying);
  feed_.set_control(Control::None);
  for (double t = 1; t < 3; t += 0.05) {
    const auto act = orders_.read(seconds(t), S::Replaying);
    EXPECT_TRUE(act.events.empty());
    EXPECT_FALSE(act.command_zero);
  }
}

/// Drives until its third decision.
class ShortScript final : public LapDriver {
 public:
  Result<DriverDecision> drive(Duration /*uptime*/, SensorTime /*now*/) override {
    return DriverDecision{.command = {0.25, 0}, .done = ++decisions_ >= 3};
  }

 private:
  int decisions_ = 0;
};

/// A person with a stick and buttons.
class FakeInput final : public OperatorInput {
 public:
  Result<OperatorRequest> read(Duration /*uptime*/, SensorTime /*now*/, S /*state*/) override {
    if (broken) return fail(ErrorCode::Unreadable, "unplugged");
    return request;
  }
  std::string usage() const override { return "sticks"; }
  OperatorRequest request{};
  bool broken = false;
};

TEST(ViewerInput, AScriptDrivesALapOnEachRequest) {
  FakeViewers viewers;
  int made = 0;
  ViewerInput input(viewers.link(), nullptr, [&] {
    ++made;
    return std::make_unique<ShortScript>();
  });
  EXPECT_FALSE(input.has_script()) << "no ground truth received";
  input.receive(TruthPose{});
  EXPECT_TRUE(input.has_script());
  viewers.order({.kind = Kind::Script});
  EXPECT_EQ(input.read(seconds(1), {}, S::Idle)->command, VelocityCommand{})
      << "it drives only while teaching";
  for (int lap = 0; lap < 2; ++lap) {
    viewers.order({.kind = Kind::Script});
    EXPECT_EQ(input.read(seconds(2), {}, S::Teaching)->command.speed_m_s, 0.25);
    EXPECT_FALSE(input.has_script()) << "it is already driving";
    EXPECT_TRUE(input.read(seconds(2), {}, S::Teaching)->events.empty());
    EXPECT_EQ(input.read(seconds(2), {}, S::Teaching)->events, std::vector<E>{E::Go}) << "ends the lap";
    (void)input.read(seconds(3), {}, S::Mapping);
  }
  EXPECT_EQ(made, 3) << "one at the start, and one after each lap";
}

TEST(ViewerInput, KeysOfThePageOverrideScriptAndSticks) {
  FakeViewers viewers;
  auto other = std::make_unique<FakeInput>();
  FakeInput& sticks = *other;
  ViewerInput input(viewers.link(), std::move(other), [] { return std::make_unique<ShortScript>(); });
  input.receive(TruthPose{});
  sticks.request.command = {0.1, 0};
  EXPECT_EQ(input.read(seconds(1), {}, S::Teaching)->command.speed_m_s, 0.1);
  viewers.order({.kind = Kind::Velocity, .command = {-0.2, 0}});
  EXPECT_EQ(input.read(seconds(1), {}, S::Teaching)->command.speed_m_s, -0.2);
  EXPECT_EQ(input.read(seconds(2), {}, S::Teaching)->command.speed_m_s, 0.1) << "the key was released";
  sticks.broken = true;
  EXPECT_FALSE(input.read(seconds(3), {}, S::Teaching));
}

TEST(ViewerInput, APersonAtTheRobotTakesOverFromALostViewer) {
  FakeViewers viewers;
  auto other = std::make_unique<FakeInput>();
  FakeInput& sticks = *other;
  ViewerInput input(viewers.link(), std::move(other), [] { return std::unique_ptr<LapDriver>(); });
  viewers.set_control(Control::Held);
  (void)input.read(seconds(1), {}, S::Teaching);
  viewers.set_control(Control::Lost);
  sticks.request.command = {0.1, 0};
  EXPECT_EQ(input.read(seconds(2), {}, S::Teaching)->command, VelocityCommand{}) << "not in the same step";
  EXPECT_EQ(input.read(seconds(2.05), {}, S::Teaching)->command.speed_m_s, 0.1);
}

TEST(ViewerInput, DescribesItsButtons) {
  FakeViewers viewers;
  const auto none = [] { return std::unique_ptr<LapDriver>(); };
  const ViewerInput alone(viewers.link(), nullptr, none);
  EXPECT_TRUE(alone.page_drives());
  testing::expect_on_page("session", alone.usage());
  EXPECT_EQ(alone.buttons(S::Idle).go, "'go'");
  const ViewerInput beside(viewers.link(), std::make_unique<FakeInput>(), none);
  EXPECT_FALSE(beside.page_drives());
  EXPECT_TRUE(beside.usage().starts_with("sticks; "));
  testing::expect_on_page("session", beside.usage());
  EXPECT_EQ(beside.buttons(S::Idle).go, OperatorButtons{}.go);
}

TEST(ViewerCommands, AreThoseWithAnEffect) {
  const auto offers = [](S state, const char* command, bool script = false) {
    const auto commands = viewer_commands(state, script);
    return std::ranges::find(commands, command) != commands.end();
  };
  EXPECT_TRUE(offers(S::Idle, "go"));
  EXPECT_FALSE(offers(S::Idle, "stop"));
  EXPECT_FALSE(offers(S::Mapping, "go"));
  EXPECT_TRUE(offers(S::Replaying, "stop"));
  EXPECT_TRUE(offers(S::Paused, "stop"));
  EXPECT_FALSE(offers(S::Teaching, "script"));  // no script is available
  EXPECT_TRUE(offers(S::Teaching, "script", true));
  EXPECT_FALSE(offers(S::Replaying, "script", true));
  EXPECT_FALSE(offers(S::Over, "quit"));
  for (const S state : {S::Ready, S::Done, S::Stopped}) EXPECT_TRUE(offers(state, "teach"));
  for (const S state : {S::Idle, S::Teaching, S::Mapping, S::Replaying, S::Paused, S::Over})
    EXPECT_FALSE(offers(state, "teach"));
}

TEST(PhaseRequests, GoEndsALapAndPausesAReplay) {
  FakeViewers viewers;
  viewers.set_control(Control::Held);
  PhaseRequests lap(viewers.link(), S::Teaching, [] { return false; });
  EXPECT_FALSE(lap.read(seconds(1)).end);
  viewers.order({.kind = Kind::Go});
  EXPECT_TRUE(lap.read(seconds(2)).end);

  PhaseRequests replay(viewers.link(), S::Replaying, [] { return false; });
  viewers.order({.kind = Kind::Go});
  EXPECT_EQ(replay.read(seconds(1)).pause, true);
  EXPECT_EQ(replay.phase(), S::Paused);
  EXPECT_FALSE(replay.read(seconds(2)).pause) << "no change";
  viewers.order({.kind = Kind::Go});
  EXPECT_EQ(replay.read(seconds(3)).pause, false);
  EXPECT_EQ(replay.phase(), S::Replaying);
  for (const Kind kind : {Kind::Stop, Kind::Quit}) {
    viewers.order({.kind = kind});
    const SessionRequest request = replay.read(seconds(4));
    EXPECT_TRUE(request.end);
    EXPECT_EQ(request.reason, "stopped on the page");
  }
}

TEST(PhaseRequests, TheSpaceBarEndsThePhase) {
  bool pressed = false;
  PhaseRequests alone(std::nullopt, S::Replaying, [&] { return pressed; });
  EXPECT_FALSE(alone.read(seconds(1)).end);
  pressed = true;
  const SessionRequest request = alone.read(seconds(2));
  EXPECT_TRUE(request.end);
  testing::expect_on_page("session", request.reason);
  FakeViewers viewers;
  PhaseRequests watched(viewers.link(), S::Teaching, [&] { return pressed; });
  EXPECT_TRUE(watched.read(seconds(1)).end);
}

TEST(PhaseRequests, ALostViewerStopsTheRobotOrPausesTheReplay) {
  FakeViewers viewers;
  viewers.set_control(Control::Held);
  PhaseRequests lap(viewers.link(), S::Teaching, [] { return false; });
  PhaseRequests replay(viewers.link(), S::Replaying, [] { return false; });
  EXPECT_FALSE(lap.read(seconds(1)).command_zero);
  (void)replay.read(seconds(1));
  viewers.set_control(Control::Lost);
  EXPECT_TRUE(lap.read(seconds(2)).command_zero);
  EXPECT_EQ(replay.read(seconds(2)).pause, true);
  EXPECT_FALSE(replay.read(seconds(3)).pause);
}

TEST(PhaseRequests, AGivenPoseIsPassedOnWithMessages) {
  std::vector<ViewerOrder> orders;
  PhaseRequests replay(ViewerLink{.take_orders = [&] { return std::exchange(orders, {}); }},
                       OperatorState::Replaying, [] { return false; });
  orders.push_back(
      {.kind = ViewerOrder::Kind::GivePose, .pose = {SE2(1, 2, 3), Eigen::Matrix3d::Identity()}});
  orders.push_back({.kind = ViewerOrder::Kind::Message, .message = "refused"});
  SessionRequest request = replay.read(std::chrono::seconds(1));
  EXPECT_EQ(request.pause, true);
  ASSERT_TRUE(request.pose);
  EXPECT_EQ(request.pose->map_T_base.y(), 2);
  EXPECT_EQ(request.messages, std::vector<std::string>{"refused"});
  EXPECT_EQ(replay.phase(), OperatorState::Paused);
  orders.push_back({.kind = ViewerOrder::Kind::GivePose, .pose = {}});
  request = replay.read(std::chrono::seconds(2));
  EXPECT_TRUE(request.pose);
  EXPECT_FALSE(request.pause) << "already paused, and not resumed by the pose";
  request = replay.read(std::chrono::seconds(3));
  EXPECT_FALSE(request.pose || request.pause || !request.messages.empty());
}

}  // namespace
}  // namespace waymark

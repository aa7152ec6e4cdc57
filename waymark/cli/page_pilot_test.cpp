#include "waymark/cli/page_pilot.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace waymark::cli {
namespace {

using E = OperatorEvent;
using S = OperatorState;
using Control = LiveFeed::Control;
using Kind = ViewerOrder::Kind;

constexpr Duration seconds(double value) { return Duration(static_cast<std::int64_t>(value * 1e9)); }

class Orders : public testing::Test {
 protected:
  LiveFeed feed_;
  PageOrders orders_{feed_};
};

TEST_F(Orders, WhatIsAskedForHappensOnce) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Go});
  EXPECT_EQ(orders_.act(seconds(1), S::Idle).events, std::vector<E>{E::Go});
  EXPECT_TRUE(orders_.act(seconds(1.05), S::Teaching).events.empty());
}

TEST_F(Orders, ASpeedHoldsForHalfASecond) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Velocity, .command = {0.3, 0}});
  EXPECT_EQ(orders_.act(seconds(1), S::Teaching).drive, (VelocityCommand{0.3, 0}));
  EXPECT_EQ(orders_.act(seconds(1.5), S::Teaching).drive, (VelocityCommand{0.3, 0}));
  EXPECT_FALSE(orders_.act(seconds(1.51), S::Teaching).drive);
}

TEST_F(Orders, TheScriptTakesOverFromAKeyThatWasJustLetGo) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Velocity, .command = {0.3, 0}});
  feed_.order({.kind = Kind::Velocity});
  EXPECT_EQ(orders_.act(seconds(1), S::Teaching).drive, VelocityCommand{});
  feed_.order({.kind = Kind::Script});
  const auto act = orders_.act(seconds(1.1), S::Teaching);
  EXPECT_TRUE(act.script);
  EXPECT_FALSE(act.drive);
  feed_.order({.kind = Kind::Velocity, .command = {0.1, 0}});
  EXPECT_TRUE(orders_.act(seconds(1.2), S::Teaching).drive);  // and a key from it
}

TEST_F(Orders, KeysStopAReplayAsSticksDo) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Velocity, .command = {0.3, 0}});
  EXPECT_EQ(orders_.act(seconds(1), S::Replaying).events, std::vector<E>{E::StickMoved});
  feed_.order({.kind = Kind::Velocity});  // a key that was let go
  EXPECT_TRUE(orders_.act(seconds(2), S::Replaying).events.empty());
}

TEST_F(Orders, WhileTeachingTheRobotStandsUntilSomebodyIsThereAgain) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Velocity, .command = {0.3, 0}});
  EXPECT_FALSE(orders_.act(seconds(1), S::Teaching).stand);
  feed_.set_control(Control::Lost);
  for (double t = 1.05; t < 5; t += 0.05) {
    const auto act = orders_.act(seconds(t), S::Teaching);
    EXPECT_TRUE(act.stand);
    EXPECT_FALSE(act.drive);
    EXPECT_TRUE(act.events.empty());
  }
  feed_.set_control(Control::Held);
  EXPECT_FALSE(orders_.act(seconds(5), S::Teaching).stand);
  feed_.set_control(Control::Lost);
  EXPECT_TRUE(orders_.act(seconds(6), S::Teaching).stand);
  orders_.somebody_is_here();  // at the robot
  EXPECT_FALSE(orders_.act(seconds(7), S::Teaching).stand);
}

/// Whatever was pressed just before: the story takes two presses within 0.3 s for one.
TEST_F(Orders, AReplayPausesWhenItsViewerGoes) {
  for (const double since_press : {0.05, 0.25, 0.5, 3.0}) {
    LiveFeed feed;
    PageOrders orders(feed);
    Operator story({}, S::Ready);
    feed.set_control(Control::Held);
    feed.order({.kind = Kind::Go});
    double t = 1;
    for (; t < 1 + since_press; t += 0.05) {
      for (const E event : orders.act(seconds(t), story.state()).events)
        (void)story.handle(event, seconds(t));
    }
    ASSERT_EQ(story.state(), S::Replaying);
    feed.set_control(Control::Lost);
    for (const double end = t + 1; t < end; t += 0.05) {
      for (const E event : orders.act(seconds(t), story.state()).events)
        (void)story.handle(event, seconds(t));
    }
    EXPECT_EQ(story.state(), S::Paused) << since_press;
    feed.set_control(Control::Held);  // and goes on when somebody says so
    feed.order({.kind = Kind::Go});
    for (const E event : orders.act(seconds(t), story.state()).events) (void)story.handle(event, seconds(t));
    EXPECT_EQ(story.state(), S::Replaying);
  }
}

TEST_F(Orders, WhoIsGoneStartsNothingButMayStop) {
  feed_.set_control(Control::Held);
  feed_.order({.kind = Kind::Go});
  feed_.order({.kind = Kind::Stop});
  feed_.set_control(Control::Lost);
  EXPECT_EQ(orders_.act(seconds(1), S::Ready).events, std::vector<E>{E::Stop});
}

TEST_F(Orders, AGivenBackControlChangesNothing) {
  feed_.set_control(Control::Held);
  (void)orders_.act(seconds(1), S::Replaying);
  feed_.set_control(Control::Nobody);
  for (double t = 1; t < 3; t += 0.05) {
    const auto act = orders_.act(seconds(t), S::Replaying);
    EXPECT_TRUE(act.events.empty());
    EXPECT_FALSE(act.stand);
  }
}

TEST(LiveState, OffersWhatMeansSomething) {
  LiveFeed feed;
  const PagePilot pilot(feed, nullptr, [] { return std::unique_ptr<LiveDriver>(); });
  const auto offers = [&](S state, const char* command) {
    const auto status = status_of(Operator({}, state), pilot);
    return std::ranges::find(status.commands, command) != status.commands.end();
  };
  EXPECT_TRUE(offers(S::Idle, "go"));
  EXPECT_FALSE(offers(S::Idle, "stop"));
  EXPECT_FALSE(offers(S::Mapping, "go"));
  EXPECT_TRUE(offers(S::Replaying, "stop"));
  EXPECT_TRUE(offers(S::Paused, "stop"));
  EXPECT_FALSE(offers(S::Teaching, "script"));  // nobody knows the way
  EXPECT_FALSE(offers(S::Over, "quit"));
  EXPECT_TRUE(status_of(Operator({}, S::Teaching), pilot).page_drives);
}

}  // namespace
}  // namespace waymark::cli

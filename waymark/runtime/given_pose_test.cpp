// A viewer says where the robot is.
#include <chrono>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/tiny_robot.hpp"
#include "waymark/runtime/replay_session.hpp"
#include "waymark/runtime/viewer_input.hpp"

namespace waymark {
namespace {

TEST(PhaseRequests, AGivenPosePausesAReplayAndWordsArePassedOn) {
  std::vector<ViewerOrder> orders;
  PhaseRequests replay(ViewerLink{.take_orders = [&] { return std::exchange(orders, {}); }},
                       OperatorState::Replaying, [] { return false; });
  orders.push_back(
      {.kind = ViewerOrder::Kind::GivePose, .pose = {SE2(1, 2, 3), Eigen::Matrix3d::Identity()}});
  orders.push_back({.kind = ViewerOrder::Kind::Words, .words = "refused"});
  SessionRequest request = replay.read(std::chrono::seconds(1));
  EXPECT_EQ(request.pause, true);
  ASSERT_TRUE(request.pose);
  EXPECT_EQ(request.pose->map_T_base.y(), 2);
  EXPECT_EQ(request.words, std::vector<std::string>{"refused"});
  EXPECT_EQ(replay.phase(), OperatorState::Paused);
  orders.push_back({.kind = ViewerOrder::Kind::GivePose, .pose = {}});
  request = replay.read(std::chrono::seconds(2));
  EXPECT_TRUE(request.pose);
  EXPECT_FALSE(request.pause) << "it stands already, and does not go on by this";
  request = replay.read(std::chrono::seconds(3));
  EXPECT_FALSE(request.pose || request.pause || !request.words.empty());
}

TEST(ReplaySession, AGivenPoseThatNoTagConfirmsIsNotCalledACarriedRobot) {
  using std::chrono::milliseconds;
  test::TinyRobot robot{SE2()};
  Replayer replayer = test::tiny_replayer();
  double given_at_m = 0;
  ReplaySession session(replayer, {}, {.give_up_s = 2}, [&](Duration uptime) {
    SessionRequest request;
    if (uptime == milliseconds(2001)) {
      given_at_m = robot.x_m();
      request.pose = GivenPose{SE2(given_at_m + 1, 0, 0), Eigen::Matrix3d::Identity() * 100};
    }
    if (uptime == milliseconds(4001)) request.pause = false;
    return request;
  });
  RobotLoop loop(robot, robot, lockstep_time([&] { return robot.clock; }), {}, {.timeout_s = 60});
  const auto driven = loop.drive(session.listener());
  ASSERT_TRUE(driven);
  const ReplayEnd end = session.end(*driven);
  EXPECT_TRUE(end.given_up);
  EXPECT_NE(end.reason.find("do not confirm the pose that was given"), std::string::npos) << end.reason;
  EXPECT_EQ(end.reason.find("carried"), std::string::npos) << end.reason;
  EXPECT_GT(given_at_m, 0.1) << "it drove";
  EXPECT_LT(robot.x_m() - given_at_m, 0.1) << "it stood";
}

}  // namespace
}  // namespace waymark

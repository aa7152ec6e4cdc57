// A viewer says where the robot is.
#include <chrono>
#include <utility>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace waymark

#include "waymark/robots/process/stamp_gate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

/// A gate that heard two seconds of odometry at 50 Hz from a clock 1000 s ahead of this computer's.
class HeardStampGate : public ::testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(odometry({})) << i;
  }

  Status odometry(Duration set_by) { return pass("/odom", set_by, true); }
  Status pass(const std::string& topic, Duration set_by, bool leads = false) {
    now_ += milliseconds(20);
    return gate_.pass(topic, SensorTime(now_ + seconds(1000) + set_by), now_, leads);
  }

  StampGate gate_{};
  Duration now_ = seconds(5);
};

TEST_F(HeardStampGate, SaysAfterASecondThatTheClockOfTheRobotWasSet) {
  const Status first = odometry(seconds(-3));
  ASSERT_FALSE(first);
  EXPECT_THAT(first.error().message, HasSubstr("3.0 s in the past by the clock of the odometry"));
  for (int i = 0; i < 45; ++i) EXPECT_THAT(odometry(seconds(-3)).error().message, HasSubstr("in the past"));
  for (int i = 0; i < 5; ++i) (void)odometry(seconds(-3));
  EXPECT_THAT(odometry(seconds(-3)).error().message, HasSubstr("clock was set back by 3.0 s"));
  EXPECT_THAT(pass("/imu", seconds(-3)).error().message, HasSubstr("in the past"));
}

TEST_F(HeardStampGate, SaysThatAClockWasSetForward) {
  for (int i = 0; i < 60; ++i) EXPECT_FALSE(odometry(seconds(7200)));
  EXPECT_THAT(odometry(seconds(7200)).error().message, HasSubstr("clock was set forward by 7200.0 s"));
}

TEST_F(HeardStampGate, DoesNotTakeAnotherNodesMessagesForAClockThatWasSet) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(odometry({})) << i;
    EXPECT_THAT(odometry(seconds(-50)).error().message, HasSubstr("in the past")) << i;
  }
}

}  // namespace
}  // namespace waymark

#include "waymark/robots/process/robot_clock.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

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

TEST(ArrivalClock, ShowsTheRobotsTimeBehindTheFastestSample) {
  ArrivalClock clock;
  EXPECT_FALSE(clock.at(seconds(1)));
  const Duration offset = seconds(1000);  // the robot's clock is so far ahead
  Random random(3);
  for (int i = 0; i < 1500; ++i) {
    const Duration truth = milliseconds(20 * i);
    const Duration way = milliseconds(2 + static_cast<int>(random.index(60)));
    clock.receive(SensorTime(truth + offset), truth + way);
    if (i < 100) continue;
    const Duration shown = clock.at(truth + way)->time_since_epoch() - offset;
    EXPECT_LE(shown, truth + way);
    EXPECT_GE(shown, truth + way - milliseconds(6)) << i;
  }
}

}  // namespace
}  // namespace waymark

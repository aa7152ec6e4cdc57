#include "waymark/robots/process/robot_clock.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

/// A gate that has received two seconds of odometry at 50 Hz from a clock 1000 s ahead of this computer's.
class RunningStampGate : public ::testing::Test {
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

TEST_F(RunningStampGate, ReportsAfterASecondThatTheClockOfTheRobotWasSet) {
  const Status first = odometry(seconds(-3));
  ASSERT_FALSE(first);
  EXPECT_THAT(first.error().message, HasSubstr("3.0 s in the past"));
  testing::expect_on_page("robots", first.error());
  for (int i = 0; i < 45; ++i) EXPECT_THAT(odometry(seconds(-3)).error().message, HasSubstr("in the past"));
  for (int i = 0; i < 5; ++i) (void)odometry(seconds(-3));
  const Error set = odometry(seconds(-3)).error();
  EXPECT_THAT(set.message, HasSubstr("back by 3.0 s"));
  testing::expect_on_page("robots", set);
  EXPECT_THAT(pass("/imu", seconds(-3)).error().message, HasSubstr("in the past"));
}

TEST_F(RunningStampGate, ReportsThatAClockWasSetForward) {
  for (int i = 0; i < 60; ++i) EXPECT_FALSE(odometry(seconds(7200)));
  EXPECT_THAT(odometry(seconds(7200)).error().message, HasSubstr("forward by 7200.0 s"));
}

TEST_F(RunningStampGate, MessagesOfAnotherNodeAreNotAClockThatWasSet) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(odometry({})) << i;
    EXPECT_THAT(odometry(seconds(-50)).error().message, HasSubstr("in the past")) << i;
  }
}

TEST(ArrivalClock, LagsTheRobotsTimeByTheSmallestDelay) {
  ArrivalClock clock;
  EXPECT_FALSE(clock.at(seconds(1)));
  const Duration offset = seconds(1000);  // the robot's clock minus this computer's clock
  Random random(3);
  for (int i = 0; i < 1500; ++i) {
    const Duration truth = milliseconds(20 * i);
    const Duration delay = milliseconds(2 + static_cast<int>(random.index(60)));
    clock.receive(SensorTime(truth + offset), truth + delay);
    if (i < 100) continue;
    const Duration estimated = clock.at(truth + delay)->time_since_epoch() - offset;
    EXPECT_LE(estimated, truth + delay);
    EXPECT_GE(estimated, truth + delay - milliseconds(6)) << i;
  }
}

}  // namespace
}  // namespace waymark

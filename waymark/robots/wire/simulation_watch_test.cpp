#include "waymark/robots/wire/simulation_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

TEST(SimulationWatch, IsSilentOnlyWhileOdometryIsMissing) {
  SimulationWatch watch({.silent = milliseconds(200), .ended = seconds(5)});
  EXPECT_FALSE(watch.silent(seconds(100))) << "no odometry yet";
  EXPECT_FALSE(watch.ended(seconds(100)));
  watch.odometry(seconds(1));
  EXPECT_FALSE(watch.silent(milliseconds(1200)));
  EXPECT_TRUE(watch.silent(milliseconds(1201)));
  watch.odometry(seconds(2));
  EXPECT_FALSE(watch.silent(milliseconds(2100)));
}

TEST(SimulationWatch, APausedSimulationIsNotAnEndedOne) {
  SimulationWatch watch({.silent = milliseconds(200), .ended = seconds(5)});
  watch.odometry(seconds(1));
  for (int s = 1; s <= 60; ++s) {
    watch.clock(seconds(s));
    EXPECT_FALSE(watch.ended(seconds(s)));
  }
  EXPECT_FALSE(watch.ended(seconds(65)));
  EXPECT_TRUE(watch.ended(seconds(65) + milliseconds(1)));
}

TEST(SimulationWatch, ReportsEachChangeOnceAndWhetherItMayBePaused) {
  SimulationWatch watch;
  watch.odometry(seconds(1));
  EXPECT_EQ(watch.take_reports(milliseconds(1100)), "");
  testing::expect_on_page("robots", watch.take_reports(seconds(2)));
  EXPECT_EQ(watch.take_reports(seconds(3)), "");
  watch.odometry(seconds(4));
  testing::expect_on_page("robots", watch.take_reports(seconds(4)));
  watch.clock(seconds(6));
  const std::string paused = watch.take_reports(seconds(6));
  EXPECT_THAT(paused, HasSubstr("paused"));
  testing::expect_on_page("robots", paused);
}

TEST(SimulationWatch, HoldsTheRobotWithinAQuarterOfASecondAndReleasesIt) {
  SimulationWatch watch;
  EXPECT_FALSE(watch.silent(std::chrono::seconds(9))) << "no odometry yet";
  for (int ms = 0; ms <= 1000; ms += 20) watch.odometry(milliseconds(ms));
  EXPECT_FALSE(watch.silent(milliseconds(1100)));
  EXPECT_EQ(watch.take_reports(milliseconds(1100)), "");
  EXPECT_TRUE(watch.silent(milliseconds(1250)));
  const std::string ended = watch.take_reports(milliseconds(1250));
  EXPECT_THAT(ended, HasSubstr("0.25 s"));
  EXPECT_EQ(ended.find("paused"), std::string::npos) << ended;
  EXPECT_EQ(watch.take_reports(milliseconds(1300)), "") << "reported once";
  watch.odometry(milliseconds(5000));
  EXPECT_FALSE(watch.silent(milliseconds(5000)));
  EXPECT_NE(watch.take_reports(milliseconds(5000)), "");
  watch.clock(milliseconds(5150));
  EXPECT_THAT(watch.take_reports(milliseconds(5250)), HasSubstr("paused"));
}

TEST(SimulationWatch, EndsAfterFiveSecondsWithoutOdometryAndClock) {
  SimulationWatch paused;
  SimulationWatch ended;
  EXPECT_FALSE(ended.ended(std::chrono::hours(1))) << "no odometry yet";
  paused.odometry(milliseconds(0));
  ended.odometry(milliseconds(0));
  for (int ms = 0; ms <= 6000; ms += 100) paused.clock(milliseconds(ms));
  EXPECT_FALSE(ended.ended(milliseconds(4900)));
  EXPECT_TRUE(ended.ended(milliseconds(5100)));
  EXPECT_TRUE(paused.silent(milliseconds(6050)));
  EXPECT_FALSE(paused.ended(milliseconds(6050)));
  EXPECT_TRUE(paused.ended(milliseconds(11'100)));
}

}  // namespace
}  // namespace waymark

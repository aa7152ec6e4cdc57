#include "waymark/app/live/system_stamps.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(SystemStamps, KeepDistancesWhenTheClockIsSet) {
  Duration steady = seconds(100);
  Duration system = seconds(1'700'000'000);
  SystemStamps stamps({.steady = [&] { return steady; }, .system = [&] { return system; }});
  const SensorTime before = stamps.at(SensorTime(steady));
  EXPECT_EQ(before.time_since_epoch(), system);
  steady += seconds(1);
  system += seconds(1) + milliseconds(1);  // slewed
  EXPECT_FALSE(stamps.take_jump());
  steady += seconds(1);
  system -= seconds(3600);
  const auto said = stamps.take_jump();
  ASSERT_TRUE(said);
  EXPECT_THAT(*said, ::testing::HasSubstr("set back by 3601.000 s"));
  EXPECT_FALSE(stamps.take_jump());
  EXPECT_EQ(stamps.now() - before, seconds(2));
}

}  // namespace
}  // namespace waymark

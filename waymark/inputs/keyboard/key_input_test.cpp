#include "waymark/inputs/keyboard/key_input.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using std::chrono::milliseconds;

using K = DriverKey;

TEST(Keys, ParsesTheBytesOfATerminal) {
  std::string bytes = "wa\x1b[A\x1b[D\x1bOCx7s \x1b[1;5B\x1b[3~q";
  EXPECT_EQ(take_keys(bytes), (std::vector{K::Forward, K::Left, K::Forward, K::Left, K::Right, K::Back,
                                           K::Stop, K::Back, K::Finish}));
  EXPECT_TRUE(bytes.empty());
  bytes = "d\x1b[";
  EXPECT_EQ(take_keys(bytes), std::vector{K::Right}) << "the arrow's sequence is incomplete";
  bytes += "A";
  EXPECT_EQ(take_keys(bytes), std::vector{K::Forward});
  bytes = "\x1b";
  EXPECT_EQ(take_keys(bytes), std::vector{K::Finish});
  bytes = "\x1b[" + std::string(1000, '0');
  EXPECT_TRUE(take_keys(bytes).empty());
  EXPECT_TRUE(bytes.empty()) << "overlong sequences are dropped";
}

TEST(KeyDriver, StopsIfNoKeyComes) {
  KeyDriver driver({.speed_m_s = 0.3, .yaw_rate_rad_s = 0.6, .hold_s = 0.6});
  EXPECT_EQ(driver.drive(milliseconds(0)), VelocityCommand{});
  driver.press(K::Forward, milliseconds(1000));
  EXPECT_EQ(driver.drive(milliseconds(1000)), (VelocityCommand{0.3, 0}));
  EXPECT_EQ(driver.drive(milliseconds(1600)), (VelocityCommand{0.3, 0}));
  EXPECT_EQ(driver.drive(milliseconds(1601)), VelocityCommand{}) << "dead-man switch";
}

TEST(KeyDriver, KeepsItsSpeedWhileTurning) {
  KeyDriver driver({.speed_m_s = 0.3, .yaw_rate_rad_s = 0.6, .hold_s = 0.6});
  driver.press(K::Forward, milliseconds(0));
  driver.press(K::Left, milliseconds(500));
  driver.press(K::Left, milliseconds(1000));
  EXPECT_EQ(driver.drive(milliseconds(1100)), (VelocityCommand{0.3, 0.6}));
  driver.press(K::Forward, milliseconds(1200));
  EXPECT_EQ(driver.drive(milliseconds(1200)), (VelocityCommand{0.3, 0})) << "straight again";
  driver.press(K::Back, milliseconds(1300));
  EXPECT_EQ(driver.drive(milliseconds(1300)), (VelocityCommand{-0.3, 0}));
  driver.press(K::Stop, milliseconds(1400));
  EXPECT_EQ(driver.drive(milliseconds(1400)), VelocityCommand{});
  driver.press(K::Finish, milliseconds(1500));
  EXPECT_FALSE(driver.drive(milliseconds(1500)));
}

}  // namespace
}  // namespace waymark

#include <cstdlib>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <termios.h>
#include <unistd.h>

#include "waymark/inputs/keyboard/key_driver.hpp"
#include "waymark/inputs/keyboard/terminal_keys.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using K = DriverKey;

TEST(Keys, OfTerminalsAreUnderstood) {
  std::string bytes = "wa\x1b[A\x1b[D\x1bOCx7s \x1b[1;5B\x1b[3~q";
  EXPECT_EQ(take_keys(bytes), (std::vector{K::Forward, K::Left, K::Forward, K::Left, K::Right, K::Back,
                                           K::Stop, K::Back, K::Finish}));
  EXPECT_TRUE(bytes.empty());
  bytes = "d\x1b[";
  EXPECT_EQ(take_keys(bytes), std::vector{K::Right}) << "the arrow is cut in two";
  bytes += "A";
  EXPECT_EQ(take_keys(bytes), std::vector{K::Forward});
  bytes = "\x1b";
  EXPECT_EQ(take_keys(bytes), std::vector{K::Finish});
  bytes = "\x1b[" + std::string(1000, '0');
  EXPECT_TRUE(take_keys(bytes).empty());
  EXPECT_TRUE(bytes.empty()) << "no terminal sends that";
}

TEST(KeyDriver, StopsWhenNoKeyComes) {
  KeyDriver driver({.speed_m_s = 0.3, .yaw_rate_rad_s = 0.6, .hold_s = 0.6});
  EXPECT_EQ(driver.drive(milliseconds(0)), VelocityCommand{});
  driver.press(K::Forward, milliseconds(1000));
  EXPECT_EQ(driver.drive(milliseconds(1000)), (VelocityCommand{0.3, 0}));
  EXPECT_EQ(driver.drive(milliseconds(1600)), (VelocityCommand{0.3, 0}));
  EXPECT_EQ(driver.drive(milliseconds(1601)), VelocityCommand{}) << "dead man";
}

TEST(KeyDriver, DrivesOnWhileItTurns) {
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

TEST(TerminalKeys, ReadsAPseudoTerminalAndPutsItBack) {
  const int master = posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_GE(master, 0);
  ASSERT_EQ(grantpt(master), 0);
  ASSERT_EQ(unlockpt(master), 0);
  const int terminal = ::open(ptsname(master), O_RDWR | O_NOCTTY);
  ASSERT_GE(terminal, 0);
  termios before{};
  ASSERT_EQ(tcgetattr(terminal, &before), 0);
  {
    auto keys = TerminalKeys::open(terminal);
    ASSERT_TRUE(keys) << to_string(keys.error());
    EXPECT_EQ((*keys)->read().value(), "") << "never waits";
    ASSERT_EQ(::write(master, "w\x1b[A", 4), 4);
    EXPECT_EQ((*keys)->read().value(), "w\x1b[A") << "no line end is needed";
  }
  termios after{};
  ASSERT_EQ(tcgetattr(terminal, &after), 0);
  EXPECT_EQ(after.c_lflag, before.c_lflag);
  EXPECT_FALSE(TerminalKeys::open(::open("/dev/null", O_RDONLY)));
  ::close(terminal);
  ::close(master);
}

}  // namespace
}  // namespace waymark

#include "waymark/inputs/keyboard/terminal_keys.hpp"

#include <cstdlib>

#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace waymark {
namespace {

using std::chrono::milliseconds;

TEST(TerminalKeys, ReadsAPseudoTerminalAndRestoresIt) {
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
    EXPECT_EQ((*keys)->read().value(), "") << "does not block";
    ASSERT_EQ(::write(master, "w\x1b[A", 4), 4);
    EXPECT_EQ((*keys)->read().value(), "w\x1b[A") << "without a newline";
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

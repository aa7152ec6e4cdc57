#include <array>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(WatchdogProgram, ItsHelpSucceedsAndIsStandardOutput) {
  const std::string command = "'" WAYMARK_WATCHDOG "' --help";
  std::FILE* out = popen(command.c_str(), "r");
  ASSERT_NE(out, nullptr);
  std::array<char, 200> line{};
  EXPECT_NE(std::fgets(line.data(), line.size(), out), nullptr);
  while (std::fgetc(out) != EOF) {
  }
  EXPECT_EQ(pclose(out), 0);
  EXPECT_EQ(std::string(line.data()).find("usage: waymark-watchdog"), 0U) << line.data();
}

}  // namespace
}  // namespace waymark

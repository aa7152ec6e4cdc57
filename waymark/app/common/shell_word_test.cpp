#include "waymark/app/common/shell_word.hpp"

#include <cstdio>

#include <gtest/gtest.h>

namespace waymark {
namespace {

/// The word as a shell interprets it.
std::string echoed(const std::string& word) {
  const std::string command = "printf %s " + word;
  std::FILE* pipe = ::popen(command.c_str(), "r");
  EXPECT_NE(pipe, nullptr);
  std::string text;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += static_cast<char>(c);
  EXPECT_EQ(::pclose(pipe), 0) << command;
  return text;
}

TEST(ShellWord, IsReadBackByTheShell) {
  for (const std::string word : {"lap.mcap", "my lap.mcap", "it's", "a$HOME`ls`", "\"quoted\"", "*?[a]",
                                 "a\\b", "#x", "~", "a;b|c&d", "(x)", "-n", "it's 'two'", "a\nb", "!x"})
    EXPECT_EQ(echoed(shell_word(word)), word);
  EXPECT_EQ(shell_word("out/lap-1.mcap"), "out/lap-1.mcap") << "plain names are not quoted";
  EXPECT_EQ(shell_word(""), "''");
}

}  // namespace
}  // namespace waymark

#include "waymark/base/message_text.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(Suggest, FindsTheNearestWord) {
  const std::vector<std::string> verbs = {"detect", "evaluate", "teach", "tags"};
  EXPECT_EQ(nearest_word("detcet", verbs), "detect");
  EXPECT_EQ(nearest_word("Teach", verbs), "teach");
  EXPECT_EQ(nearest_word("36h11", {"tag16h5", "tag36h11"}), "tag36h11");
  EXPECT_EQ(nearest_word("banana", verbs), "");
  EXPECT_EQ(nearest_word("", verbs), "");
  EXPECT_EQ(suggestion("tech", verbs), "Did you mean 'teach'?");
  EXPECT_EQ(suggestion("xyzzy", {"a", "b"}), "Known: a, b.");
}

TEST(Printable, ControlCharactersAreEscaped) {
  EXPECT_EQ(printable("battery low: 12.1 V"), "battery low: 12.1 V");
  EXPECT_EQ(printable("\x1b[2Jgone\r\n\tover\x7f"), "\\x1b[2Jgone\\x0d\\x0a\\x09over\\x7f");
  EXPECT_EQ(printable("\x1b]0;title\x07"), "\\x1b]0;title\\x07");
  EXPECT_EQ(printable("Grüße, 日本, 🤖"), "Grüße, 日本, 🤖") << "letters are kept";
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\xc2\\x9b31m")
      << "a two-byte control character";
  EXPECT_EQ(printable("a\x9b"
                      "31m"),
            "a\\x9b31m")
      << "a one-byte control character";
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable(""), "");
}

}  // namespace
}  // namespace waymark

#include "waymark/robots/watchdog/pipes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

TEST(LineSplitter, SplitsAStreamOfSingleBytes) {
  LineSplitter lines(8);
  for (const char byte : std::string("one\n\ntwo two too long\nthree\nrest")) lines.add({&byte, 1});
  EXPECT_EQ(lines.next()->text, "one");
  EXPECT_EQ(lines.next()->text, "");
  const auto third = lines.next();
  ASSERT_TRUE(third);
  EXPECT_TRUE(third->too_long);
  EXPECT_EQ(third->text, "two two ");
  EXPECT_EQ(third->number, 3);
  const auto fourth = lines.next();
  ASSERT_TRUE(fourth);
  EXPECT_FALSE(fourth->too_long);
  EXPECT_EQ(fourth->number, 4);
  EXPECT_FALSE(lines.next());
  EXPECT_EQ(lines.rest()->text, "rest");
  EXPECT_FALSE(lines.rest());
}

TEST(LineQueue, DropsOnlyWholeLines) {
  LineQueue queue(20);
  queue.push("first line\n");
  queue.pop(3);  // partly written
  for (int i = 0; i < 100; ++i) queue.push(std::to_string(i) + "\n");
  EXPECT_GT(queue.dropped(), 80);
  std::string written;
  while (!queue.empty()) {
    written += queue.front().substr(0, 2);
    queue.pop(std::min<std::size_t>(2, queue.front().size()));
  }
  EXPECT_TRUE(written.starts_with("st line\n9")) << written;
  EXPECT_TRUE(written.ends_with("\n98\n99\n")) << written;
}

}  // namespace
}  // namespace waymark

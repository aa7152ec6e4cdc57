#include "waymark/config/robot_list.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(RobotList, EveryRobotThatComesWithWaymarkIsReadAndSaysWhatItIs) {
  const auto robots = list_shared("robots");
  ASSERT_TRUE(robots) << to_string(robots.error());
  ASSERT_GE(robots->size(), 6U);
  for (const ListedFile& listed : *robots) {
    const auto shown = read_commented_robot(listed.path);
    ASSERT_TRUE(shown) << to_string(shown.error());
    EXPECT_EQ(shown->robot.model.name, listed.name) << "one name, by which it is found";
    EXPECT_EQ(read_named_robot(listed.name)->model.name, listed.name);
    EXPECT_GT(first_sentence(shown->comment).size(), 20U) << listed.name;
  }
  EXPECT_FALSE(read_named_robot("no such robot"));
  EXPECT_TRUE(std::ranges::is_sorted(*robots, {}, &ListedFile::name));
}

TEST(RobotList, AFolderThatIsNotThereIsAnError) { EXPECT_FALSE(list_shared("no such folder")); }

TEST(RobotList, TheCommentAtTheBeginIsOneText) {
  const std::string text =
      leading_comment("# A robot of 1.5 m.\r\n#  It drives.\n#\n# Well.\nname: x\n# no\n");
  EXPECT_EQ(text, "A robot of 1.5 m. It drives. Well.");
  EXPECT_EQ(first_sentence(text), "A robot of 1.5 m.");
  EXPECT_EQ(leading_comment("name: x\n"), "");
  EXPECT_EQ(leading_comment("#"), "");
  EXPECT_EQ(first_sentence("no end"), "no end");
}

}  // namespace
}  // namespace waymark

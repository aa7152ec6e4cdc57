#include "waymark/robots/wire/robot_talk.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/robot_lines.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

TEST(RobotTalk, WordsGoToThePersonUntilTheHelloAndThenDownTheWire) {
  std::vector<std::string> sent;
  std::vector<std::string> said;
  bool reads = true;
  const RobotWire wire{.input = 0,
                       .write =
                           [&](const std::string& line) {
                             sent.push_back(line);
                             return reads;
                           },
                       .say = [&](const std::string& words) { said.push_back(words); }};
  RobotTalk talk(wire);
  talk.say("no odometry yet");
  EXPECT_THAT(said, ElementsAre("no odometry yet"));
  EXPECT_THAT(sent, SizeIs(0));
  talk.greet({.name = "limo"});
  talk.say_once("the battery is low");
  talk.say_once("the battery is low");
  EXPECT_THAT(said, SizeIs(1));
  EXPECT_THAT(sent, ElementsAre(HasSubstr("limo"), HasSubstr("the battery is low")));
  reads = false;
  talk.write({"a\n", "b\n"});
  EXPECT_FALSE(talk.open());
  EXPECT_THAT(sent, SizeIs(3)) << "nothing more once nobody reads";
}

}  // namespace
}  // namespace waymark

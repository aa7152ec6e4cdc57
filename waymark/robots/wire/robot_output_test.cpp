#include "waymark/robots/wire/robot_output.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/robot_lines.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

TEST(RobotOutput, MessagesGoToTheUserUntilTheHelloAndAreLogLinesAfterIt) {
  std::vector<std::string> sent;
  std::vector<std::string> shown;
  bool reads = true;
  const RobotWire wire{.input = 0,
                       .write =
                           [&](const std::string& line) {
                             sent.push_back(line);
                             return reads;
                           },
                       .note = [&](const std::string& text) { shown.push_back(text); }};
  RobotOutput output(wire);
  output.report("no odometry yet");
  EXPECT_THAT(shown, ElementsAre("no odometry yet"));
  EXPECT_THAT(sent, SizeIs(0));
  output.greet({.name = "limo"});
  output.report_once("the battery is low");
  output.report_once("the battery is low");
  EXPECT_THAT(shown, SizeIs(1));
  EXPECT_THAT(sent, ElementsAre(HasSubstr("limo"), HasSubstr("the battery is low")));
  reads = false;
  output.write({"a\n", "b\n"});
  EXPECT_FALSE(output.open());
  EXPECT_THAT(sent, SizeIs(3)) << "nothing is written once the reader has disconnected";
}

}  // namespace
}  // namespace waymark

#include "waymark/app/robot/robot_table.hpp"

#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/yaml/robot_file.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

RobotDescription limo() { return read_robot(WAYMARK_SHARE "/robots/limo.yaml").value(); }

TEST(RobotText, ContainsBodyLimitsWheelsAndEveryCamera) {
  RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo-front-rear.yaml").value();
  robot.model.hull = {.front_m = 0.2, .rear_m = 0.1, .width_m = 0.22, .height_m = 0.25};
  robot.model.limits.yaw_rate_rad_s = to_radians(90);
  const std::string text = robot_text(robot, "From the maker's page.");
  EXPECT_THAT(text, HasSubstr(robot.model.name + "\nFrom the maker's page.\n"));
  for (const char* part : {"0.300 m long", "0.100 m", "0.220 m wide", "0.250 m high", "(90 degrees/s)"})
    EXPECT_THAT(text, HasSubstr(part));
  EXPECT_THAT(text, HasSubstr("camera front: "));
  EXPECT_THAT(text, HasSubstr("camera rear: "));
  EXPECT_THAT(text, ::testing::Not(HasSubstr("-0.0"))) << "no negative zero";
}

TEST(RobotText, WrapsLongCommentsAtSpaces) {
  std::string comment;
  for (int i = 0; i < 60; ++i)
    comment += (i == 0 ? "" : " ") + std::string(1 + static_cast<std::size_t>(i % 11), 'x');
  std::istringstream lines(robot_text(limo(), comment));
  std::string line;
  std::string joined;
  std::getline(lines, line);  // skips the name
  while (std::getline(lines, line) && !line.starts_with("body:")) {
    EXPECT_LE(line.size(), 100U);
    joined += (joined.empty() ? "" : " ") + line;
  }
  EXPECT_EQ(joined, comment);
  const std::string word(230, 'w');
  EXPECT_THAT(robot_text(limo(), word),
              HasSubstr(std::string(100, 'w') + "\n" + std::string(100, 'w') + "\n"))
      << "a very long word is cut";
}

TEST(RobotWays, NamesTheProfilesOfGazebo) {
  EXPECT_THAT(ways_to_reach("limo-gazebo"), ::testing::Contains(HasSubstr("`robot=gazebo:limo` ")));
  EXPECT_THAT(ways_to_reach("limo"), ::testing::Contains(HasSubstr("`robot=ros2:limo` ")));
}

}  // namespace
}  // namespace waymark

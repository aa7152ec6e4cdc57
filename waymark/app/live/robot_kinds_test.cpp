#include "waymark/app/live/robot_kinds.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/replay/replay_route.hpp"
#include "waymark/app/session/run_session.hpp"
#include "waymark/app/teach/teach_lap.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(RobotKinds, TheKindSelectsHowTheRobotIsStarted) {
  const auto process = load_kind("process:my robot", "", "mbot", 1);
  ASSERT_TRUE(process.has_value() && *process);
  EXPECT_EQ((*process)->process.shell, "my robot");
  const auto ros2 = load_kind("ros2:turtlebot3", "", "", 1);
  ASSERT_TRUE(ros2.has_value() && *ros2);
  const std::string self = fs::read_symlink("/proc/self/exe").string();
  EXPECT_THAT((*ros2)->process.words,
              ElementsAre(self, "ros2", "robot", "turtlebot3", "--robot-file", "turtlebot3-waffle-pi"));
  EXPECT_EQ((*ros2)->robot().model.name, load_setup("", "turtlebot3-waffle-pi", 1)->robot().model.name);
  EXPECT_EQ((*load_kind("ros2:limo", "", "mbot", 1))->process.words.back(), "mbot")
      << "specified by the user";
  EXPECT_FALSE(load_kind("sim", "", "", 1).has_value());
  EXPECT_FALSE(load_kind("ros2", "", "", 1).has_value()) << "no colon";
}

TEST(RobotKinds, AnInvalidAddressIsAnError) {
  for (const RobotKind& kind : robot_kinds()) {
    const std::string address =
        kind.name == "mbot" ? "udpm://300.0.0.1:7" : "";  // an empty address selects the default address
    const auto setup = load_kind(fmt::format("{}:{}", kind.name, address), "", "", 1);
    ASSERT_TRUE(setup.has_value()) << kind.name;
    ASSERT_FALSE(*setup) << kind.name;
    EXPECT_FALSE(setup->error().hint.empty()) << kind.name;
  }
}

TEST(LoadRobot, IsSimulatedInAWorldOrAProcessOfAKind) {
  EXPECT_EQ(load_robot("sim", "circuit24", "", 1, false)->simulated.world.name, "circuit24");
  EXPECT_FALSE(load_robot("process:true", "", "", 1, true)->process.empty());
  const auto refused = [](const char* robot, const char* world, bool processes) {
    const auto setup = load_robot(robot, world, "", 1, processes);
    if (!setup) testing::expect_on_page("live", setup.error());
    return setup ? "" : to_string(setup.error());
  };
  EXPECT_THAT(refused("sim", "", true), StartsWith("(world): `world`"));
  EXPECT_THAT(refused("smi", "circuit24", true), AllOf(StartsWith("(robot): "), HasSubstr("'smi'")));
  EXPECT_THAT(refused("process:true", "circuit24", false),
              AllOf(StartsWith("(robot): "), HasSubstr("'process:true'")));
}

}  // namespace
}  // namespace waymark

#include "waymark/app/live/robot_setup.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/replay/replay_route.hpp"
#include "waymark/app/session/run_session.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(LoadSetup, PrefersTheGivenRobotThenThatOfTheWorldThenLimo) {
  const auto circuit = load_setup("circuit24", "", 7);
  ASSERT_TRUE(circuit) << to_string(circuit.error());
  EXPECT_EQ(circuit->simulated.world.name, "circuit24");
  EXPECT_EQ(circuit->simulated.model.name, load_setup("", "limo", 7)->simulated.model.name);
  EXPECT_EQ(circuit->simulated.robot.seed, 7U);
  const auto square = load_setup("mbot-square", "", 1);
  ASSERT_TRUE(square) << to_string(square.error());
  EXPECT_NE(square->simulated.model.name, circuit->simulated.model.name) << "the world names its robot";
  const auto other = load_setup("mbot-square", "limo", 1);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->simulated.model.name, circuit->simulated.model.name)
      << "the robot specified by the user takes precedence";
  EXPECT_EQ(other->world_yaml, square->world_yaml);
  EXPECT_EQ(other->robot().model.name, other->simulated.model.name);
}

TEST(LoadSetup, AnUnknownWorldIsEmpty) {
  const auto setup = load_setup("", "", 1);
  ASSERT_TRUE(setup) << to_string(setup.error());
  EXPECT_TRUE(setup->world_yaml.empty());
  EXPECT_TRUE(setup->simulated.world.tags.tags.empty());
  EXPECT_FALSE(setup->robot_yaml.empty());
}

TEST(LoadSetup, SuggestsTheNearestNameForAMisspeltOne) {
  const auto world = load_setup("circuit42", "", 1);
  ASSERT_FALSE(world);
  EXPECT_THAT(world.error().hint, HasSubstr("circuit24"));
  const auto robot = load_setup("circuit24", "limu", 1);
  ASSERT_FALSE(robot);
  EXPECT_THAT(robot.error().hint, HasSubstr("limo"));
  const fs::path file = testing::fresh_folder("live_setup") / "world.yaml";
  ASSERT_TRUE(write_text_file(file, "name: [broken\n"));
  const auto broken = load_setup(file.string(), "", 1);
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().place.source, file.string());
}

TEST(OwnRobot, StartsThisProgramWithoutAShell) {
  RobotSetup setup = load_setup("", "", 1).value();
  ASSERT_TRUE(become_the_robot(setup, {"--world", "a world; rm"}, {.lockstep = true, .pace = 1.5}));
  const std::string self = fs::read_symlink("/proc/self/exe").string();
  EXPECT_THAT(setup.process.words,
              ElementsAre(self, "robot-sim", "--world", "a world; rm", "--lockstep", "--pace", "1.5"));
  EXPECT_TRUE(setup.process.shell.empty());
  ASSERT_TRUE(become_the_robot(setup, {}, {.lockstep = false, .pace = 2}));
  EXPECT_THAT(setup.process.words, ElementsAre(self, "robot-sim")) << "pace applies only to lockstep";
}

TEST(LoadRobot, TheFolderOfAMapMayContainTheRobotFile) {
  const auto folder = testing::fresh_folder("live_job_checks");
  EXPECT_EQ(robot_file_in(folder), "");
  std::ofstream(folder / "robot.yaml") << "\n";
  EXPECT_EQ(robot_file_in(folder), (folder / "robot.yaml").string());
}

}  // namespace
}  // namespace waymark

// A robot in its world, and who drives it.
#include "waymark/app/live/robot_setup.hpp"

#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/replay/robot_difference.hpp"
#include "waymark/app/robot/robot_table.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(LoadSetup, TheRobotIsTheOneThatIsNamedElseThatOfTheWorldElseLimo) {
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
  EXPECT_EQ(other->simulated.model.name, circuit->simulated.model.name) << "what is named counts more";
  EXPECT_EQ(other->world_yaml, square->world_yaml);
  EXPECT_EQ(other->robot().model.name, other->simulated.model.name);
}

TEST(LoneAnchor, IsGivenWhereNobodyKnowsTheWorldAndOnlyThere) {
  const RobotSetup simulated = load_setup("circuit24", "", 1).value();
  RobotSetup process = load_setup("", "limo", 1).value();
  process.process = "true";
  RobotSetup known = simulated;
  known.process = "true";
  for (RobotSetup setup : {simulated, known}) {
    EXPECT_TRUE(place_lone_anchor(setup, {}));
    EXPECT_FALSE(place_lone_anchor(setup, {.anchor = "0"}));
    EXPECT_FALSE(place_lone_anchor(setup, {.tag_size_m = 0.16}));
  }
  EXPECT_FALSE(place_lone_anchor(process, {}));
  EXPECT_FALSE(place_lone_anchor(process, {.anchor = "0"}));
  EXPECT_FALSE(place_lone_anchor(process, {.tag_size_m = 0.16}));
  EXPECT_FALSE(place_lone_anchor(process, {.anchor = "no tag", .tag_size_m = 0.16}));
  ASSERT_TRUE(place_lone_anchor(process, {.anchor = "7", .tag_size_m = 0.16}));
  const World& world = process.simulated.world;
  EXPECT_EQ(to_string(world.anchor), "tag36h11:7");
  ASSERT_NE(world.tags.find(world.anchor), nullptr);
  EXPECT_EQ(world.tags.find(world.anchor)->size_m, 0.16);
}

TEST(LoneAnchor, OfAMapThatIsThereIsTheMapsUnlessOneIsGiven) {
  RobotSetup setup = load_setup("", "limo", 1).value();
  setup.process = "true";
  const fs::path none = testing::fresh_folder("lone_anchor");
  EXPECT_TRUE(place_lone_anchor(setup, {}, none.string())) << "said where the map is read";
  EXPECT_FALSE(place_lone_anchor(setup, {}, "")) << "no map: it must be given";
  ASSERT_TRUE(place_lone_anchor(setup, {.anchor = "3", .tag_size_m = 0.1}, none.string()));
  EXPECT_EQ(to_string(setup.simulated.world.anchor), "tag36h11:3");
}

TEST(RobotDifference, NamesWhatAReplayRestsOn) {
  const RobotDescription limo = load_setup("", "limo", 1)->robot();
  EXPECT_THAT(robot_differences(limo, limo), ElementsAre());
  EXPECT_THAT(robot_differences(limo, load_setup("", "limo-gazebo", 1)->robot()), ElementsAre("camera"));
  EXPECT_THAT(robot_differences(limo, load_setup("", "mbot", 1)->robot()),
              ElementsAre("hull", "wheels", "camera", HasSubstr("camera mounting by ")));
  RobotDescription tilted = limo;
  tilted.model.base_T_cam =
      SE3(SO3::from_rpy(0, 0.05, 0), Eigen::Vector3d(0.02, 0, 0)) * limo.model.base_T_cam;
  EXPECT_THAT(robot_differences(limo, tilted), ElementsAre(HasSubstr("2.9 deg")));
}

TEST(RobotDifference, IsSaidBeforeAReplay) {
  const fs::path map = fs::temp_directory_path() / fmt::format("waymark_other_robot_{}", getpid());
  fs::create_directories(map);
  const RobotSetup limo = load_setup("", "limo", 1).value();
  RobotSetup mbot = load_setup("", "mbot", 1).value();
  EXPECT_THAT(other_robot_words(mbot, map), ElementsAre()) << "nobody knows by which robot it was taught";
  ASSERT_TRUE(write_text_file(map / "robot.yaml", limo.robot_yaml));
  EXPECT_THAT(other_robot_words(limo, map), ElementsAre()) << "the same robot, from another file";
  EXPECT_THAT(other_robot_words(mbot, map), ElementsAre(HasSubstr("driven by another robot")));
  const auto kind = load_kind("mbot:", "", (map / "robot.yaml").string(), 1);
  ASSERT_TRUE(kind && *kind);
  EXPECT_THAT(other_robot_words(**kind, map),
              ElementsAre(HasSubstr("Where this is a mbot: --robot-file mbot")));
  const auto own = load_kind("limo:/dev/ttyTHS1", "", (map / "robot.yaml").string(), 1);
  ASSERT_TRUE(own && *own);
  EXPECT_THAT(other_robot_words(**own, map), ElementsAre());
  fs::remove_all(map);
}

TEST(RobotWays, NamesTheProfilesOfGazebo) {
  EXPECT_THAT(ways_to_reach("limo-gazebo"), ::testing::Contains(HasSubstr("--robot gazebo:limo ")));
  EXPECT_THAT(ways_to_reach("limo"), ::testing::Contains(HasSubstr("--robot ros2:limo ")));
}

TEST(LoadSetup, WithoutAWorldNothingIsThereAndNobodyKnowsIt) {
  const auto setup = load_setup("", "", 1);
  ASSERT_TRUE(setup) << to_string(setup.error());
  EXPECT_TRUE(setup->world_yaml.empty());
  EXPECT_TRUE(setup->simulated.world.tags.tags.empty());
  EXPECT_FALSE(setup->robot_yaml.empty());
}

TEST(LoadSetup, AMisspeltNameIsAnErrorWithTheNearestOne) {
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

TEST(OwnRobot, TheProgramIsStartedAgainWithoutAShell) {
  RobotSetup setup = load_setup("", "", 1).value();
  ASSERT_TRUE(become_the_robot(setup, {"--world", "a world; rm"}, {.lockstep = true, .pace = 1.5}));
  const std::string self = fs::read_symlink("/proc/self/exe").string();
  EXPECT_THAT(setup.process.words,
              ElementsAre(self, "robot-sim", "--world", "a world; rm", "--lockstep", "--pace", "1.5"));
  EXPECT_TRUE(setup.process.shell.empty());
  ASSERT_TRUE(become_the_robot(setup, {}, {.lockstep = false, .pace = 2}));
  EXPECT_THAT(setup.process.words, ElementsAre(self, "robot-sim")) << "a pace is one of lockstep";
}

TEST(RobotKinds, TheWordBeforeTheColonSaysHowTheRobotIsStarted) {
  const auto process = load_kind("process:my robot", "", "mbot", 1);
  ASSERT_TRUE(process.has_value() && *process);
  EXPECT_EQ((*process)->process.shell, "my robot");
  const auto ros2 = load_kind("ros2:turtlebot3", "", "", 1);
  ASSERT_TRUE(ros2.has_value() && *ros2);
  const std::string self = fs::read_symlink("/proc/self/exe").string();
  EXPECT_THAT((*ros2)->process.words,
              ElementsAre(self, "ros2", "robot", "turtlebot3", "--robot-file", "turtlebot3-waffle-pi"));
  EXPECT_EQ((*ros2)->robot().model.name, load_setup("", "turtlebot3-waffle-pi", 1)->robot().model.name);
  EXPECT_EQ((*load_kind("ros2:limo", "", "mbot", 1))->process.words.back(), "mbot") << "named by the user";
  EXPECT_FALSE(load_kind("sim", "", "", 1).has_value());
  EXPECT_FALSE(load_kind("ros2", "", "", 1).has_value()) << "no colon";
}

TEST(RobotKinds, AnAddressThatMakesNoSenseIsAnError) {
  for (const RobotKind& kind : robot_kinds()) {
    const std::string address = kind.name == "mbot" ? "udpm://300.0.0.1:7" : "";  // it has a usual one
    const auto setup = load_kind(fmt::format("{}:{}", kind.name, address), "", "", 1);
    ASSERT_TRUE(setup.has_value()) << kind.name;
    ASSERT_FALSE(*setup) << kind.name;
    EXPECT_FALSE(setup->error().hint.empty()) << kind.name;
  }
}

TEST(LiveRobot, AProgramThatDoesNotGreetIsAnError) {
  RobotSetup setup = load_setup("", "", 1).value();
  setup.process = RobotCommand("exit 3");
  const auto gone = LiveRobot::open(setup, {});
  ASSERT_FALSE(gone);
  setup.process = RobotCommand(std::vector<std::string>{"/nowhere/robot"});
  const auto missing = LiveRobot::open(setup, {});
  ASSERT_FALSE(missing);
}

TEST(Inputs, AnUnknownDriverIsAnErrorThatNamesTheFlag) {
  const SimulatedSetup setup = load_setup("circuit24", "", 1)->simulated;
  for (const auto& error : {make_lap_driver("scriptet", 0.3, setup).error(),
                            make_operator_input("scriptet", 0.3, setup).error()}) {
    EXPECT_EQ(error.code, ErrorCode::InvalidArgument);
    EXPECT_EQ(error.place.key, "--driver");
    EXPECT_THAT(error.hint, HasSubstr("scripted"));
  }
}

TEST(Inputs, EveryNameIsAnInputOrAnErrorInWords) {
  const SimulatedSetup setup = load_setup("circuit24", "", 1)->simulated;
  for (const std::string& name : lap_drivers()) {
    const auto driver = make_lap_driver(name, 0.3, setup);
    if (!driver) EXPECT_FALSE(driver.error().message.empty()) << name;
    if (name == "scripted") EXPECT_TRUE(driver) << to_string(driver.error());
  }
  for (const std::string& name : operator_inputs()) {
    const auto input = make_operator_input(name, 0.3, setup);
    if (!input) EXPECT_THAT(to_string(input.error()), ::testing::Not(HasSubstr("no driver"))) << name;
  }
  EXPECT_TRUE(make_operator_input("lines", 0.3, setup));
}

TEST(Inputs, AScriptNeedsALineToDrive) {
  const SimulatedSetup nowhere = load_setup("", "", 1)->simulated;
  EXPECT_FALSE(make_lap_driver("scripted", 0.3, nowhere));
  EXPECT_FALSE(make_operator_input("scripted", 0.3, nowhere));
}

TEST(Inputs, ThePageNeedsViewers) {
  const SimulatedSetup setup = load_setup("circuit24", "", 1)->simulated;
  EXPECT_FALSE(viewer_link(nullptr)) << "without a feed there are none";
  const auto alone = make_operator_input("page", 0.3, setup);
  ASSERT_FALSE(alone);
  EXPECT_THAT(alone.error().hint, HasSubstr("--view"));
  const ViewerLink viewers;
  EXPECT_TRUE(make_operator_input("page", 0.3, setup, viewers));
  EXPECT_TRUE(make_operator_input("scripted", 0.3, setup, viewers)) << "the page has the buttons as well";
}

TEST(StopKey, WhereTheDriverReadsTheKeysNothingIsPressed) {
  StopKey taken(true);
  EXPECT_FALSE(taken.watched());
  EXPECT_FALSE(taken.pressed());
}

}  // namespace
}  // namespace waymark

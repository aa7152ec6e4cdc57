// Tests what each wire requires of a simulated robot, checked before anything is opened.
#include "waymark/app/robot/robot_sim.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

RobotSetup setup_with(bool images) {
  RobotSetup setup = load_setup("circuit24", "", 3).value();
  if (images) setup.simulated.images = DetectingCameraOptions{};
  return setup;
}

TEST(RobotSim, OnlyGazeboNeedsImagesAndHasNoWatchdog) {
  const std::vector<SimWire> others = {ProcessSimOptions{}, Ros2SimOptions{}, LimoSimOptions{},
                                       MbotSimOptions{}};
  for (const SimWire& wire : others) {
    RobotSetup setup = setup_with(false);
    const double watchdog_s = setup.simulated.robot.watchdog_s;
    EXPECT_TRUE(fit_to_wire(wire, setup.simulated));
    EXPECT_EQ(setup.simulated.robot.watchdog_s, watchdog_s);
  }
  RobotSetup blind = setup_with(false);
  EXPECT_FALSE(fit_to_wire(GazeboSimOptions{}, blind.simulated));
  RobotSetup sees = setup_with(true);
  EXPECT_TRUE(fit_to_wire(GazeboSimOptions{}, sees.simulated));
  EXPECT_GT(sees.simulated.robot.watchdog_s, 1e5);
}

TEST(RobotSim, StartsAtTheBeginningOfThePath) {
  const RobotSetup setup = setup_with(false);
  const auto plant = make_plant(ProcessSimOptions{}, setup, {});
  ASSERT_TRUE(plant) << to_string(plant.error());
  const auto& line = setup.simulated.world.path_m;
  while ((*plant)->uptime() < std::chrono::seconds(1)) {
    const auto sample = (*plant)->next();
    ASSERT_TRUE(sample);
    const auto* truth = std::get_if<TruthPose>(&*sample);
    if (truth == nullptr) continue;
    EXPECT_NEAR((truth->map_T_base.translation().head<2>() - line.front()).norm(), 0, 0.03);
  }
  RobotSetup nowhere = setup;
  nowhere.simulated.world.path_m.clear();
  EXPECT_FALSE(make_plant(ProcessSimOptions{}, nowhere, {}));
}

TEST(RobotSim, RefusesAProgramThatDoesNotSendWhatTheWireNeeds) {
  RobotSetup setup = setup_with(false);
  setup.process = "exec '" WAYMARK_PROGRAM "' robot-sim --world circuit24 --lockstep";  // sends corners, no
                                                                                        // images
  const auto plant = make_plant(GazeboSimOptions{}, setup, {});
  ASSERT_FALSE(plant);
  EXPECT_THAT(to_string(plant.error()), HasSubstr("image"));
  EXPECT_TRUE(make_plant(MbotSimOptions{}, setup, {}));
}

TEST(RobotSim, RefusesImagesOfAnMbot) {
  const RobotSetup setup = setup_with(true);
  const auto plant = make_plant(MbotSimOptions{}, setup_with(false), {});
  ASSERT_TRUE(plant);
  const Status refused =
      run_robot_sim(MbotSimOptions{}, **plant, setup.simulated, [](const std::string&) {}, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().place.key, "images");
  testing::expect_on_page("robots", refused.error());
}

TEST(RobotSim, ASerialPortEndsWhenItIsCancelled) {
  const RobotSetup setup = setup_with(false);
  const auto plant = make_plant(LimoSimOptions{}, setup, {});
  ASSERT_TRUE(plant);
  std::string port;
  JobControl control;
  control.cancelled = [&] { return !port.empty(); };
  const Status ended = run_robot_sim(
      LimoSimOptions{}, **plant, setup.simulated, [&](const std::string& path) { port = path; }, control);
  EXPECT_TRUE(ended) << to_string(ended.error());
  EXPECT_THAT(port, HasSubstr("/dev/pts/"));
}

}  // namespace
}  // namespace waymark

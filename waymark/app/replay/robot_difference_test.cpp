#include "waymark/app/replay/robot_difference.hpp"

#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(RobotDifference, NamesPropertiesThatAffectAReplay) {
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

TEST(RobotDifference, IsReportedBeforeAReplay) {
  const fs::path map = fs::temp_directory_path() / fmt::format("waymark-other-robot-{}", getpid());
  fs::create_directories(map);
  const RobotSetup limo = load_setup("", "limo", 1).value();
  RobotSetup mbot = load_setup("", "mbot", 1).value();
  EXPECT_THAT(robot_difference_warnings(mbot, map), ElementsAre()) << "the taught robot is unknown";
  ASSERT_TRUE(write_text_file(map / "robot.yaml", limo.robot_yaml));
  EXPECT_THAT(robot_difference_warnings(limo, map), ElementsAre()) << "the same robot, from another file";
  const auto other = robot_difference_warnings(mbot, map);
  ASSERT_THAT(other, ElementsAre(HasSubstr("hull, wheels, camera")));
  const auto kind = load_kind("mbot:", "", (map / "robot.yaml").string(), 1);
  ASSERT_TRUE(kind && *kind);
  EXPECT_THAT(robot_difference_warnings(**kind, map), ElementsAre(HasSubstr("`robot_file=mbot`")));
  testing::expect_on_page("replay", robot_difference_warnings(**kind, map).front());

  const auto own = load_kind("limo:/dev/ttyTHS1", "", (map / "robot.yaml").string(), 1);
  ASSERT_TRUE(own && *own);
  EXPECT_THAT(robot_difference_warnings(**own, map), ElementsAre());
  fs::remove_all(map);
}

}  // namespace
}  // namespace waymark

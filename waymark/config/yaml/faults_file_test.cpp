#include "waymark/config/yaml/faults_file.hpp"

#include <numbers>

#include <gtest/gtest.h>

#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/simulation/world/world_check.hpp"

namespace waymark {
namespace {

World circuit() { return read_world(WAYMARK_SHARE "/worlds/circuit24.yaml").value(); }

std::string error_of(const std::string& entry) {
  const auto faults = parse_faults("faults:\n  - " + entry + "\n", "f.yaml", circuit());
  return faults ? "none" : to_string(faults.error());
}

TEST(FaultsFile, ReadsEveryKind) {
  const auto faults = parse_faults(R"(faults:
  - {fault: camera_blackout, at_s: 10, for_s: 2}
  - {fault: camera_frozen, at_s: 10, for_s: 2}
  - {fault: camera_lost, at_s: 10, for_s: 2}
  - {fault: odometry_lost, at_s: 20, for_s: 3}
  - {fault: tag_moved, id: 3, x_m: 0.3, z_m: 0.1, turn_deg: 90}
  - {fault: tag_removed, at_s: 5, id: 4}
  - {fault: tag_duplicated, id: 5, x_m: 1, y_m: 2, z_m: 0.3, facing_deg: 0}
  - {fault: tags_swapped, id: 6, with_id: 7}
  - {fault: kidnapped, at_s: 30, forward_m: 1, left_m: 0.5, turn_deg: 180}
  - {fault: clock_jump, at_s: 40, jump_s: -0.5}
  - {fault: slip_burst, at_s: 45, for_s: 0.5, speed_share: 0.3}
  - {fault: camera_stuck, at_s: 10}
  - {fault: wheels_blocked, at_s: 10, for_s: 2}
  - {fault: robot_held, at_s: 10, for_s: 2}
  - {fault: carried, at_s: 10, for_s: 5, left_m_s: 0.03, turn_deg_s: 90}
  - {fault: battery_sag, at_s: 10, speed_share: 0.85}
)",
                                   "f.yaml", circuit());
  ASSERT_TRUE(faults) << to_string(faults.error());
  ASSERT_EQ(faults->size(), fault_names().size());
  EXPECT_EQ(faults->at(0).at_s, 10);
  EXPECT_EQ(faults->at(4).shift_m, Eigen::Vector3d(0.3, 0, 0.1));
  EXPECT_NEAR(faults->at(4).turn_rad, std::numbers::pi / 2, 1e-12);
  EXPECT_EQ(faults->at(7).other.number, 7);
  EXPECT_NEAR(faults->at(8).base_T_put.y(), 0.5, 1e-12);
  EXPECT_EQ(faults->at(9).jump_s, -0.5);
  EXPECT_EQ(faults->at(10).speed_share, 0.3);
  EXPECT_EQ(faults->at(14).carry.y(), 0.03);
  EXPECT_NEAR(faults->at(14).carry.z(), std::numbers::pi / 2, 1e-12);
  EXPECT_EQ(faults->at(15).speed_share, 0.85);
}

TEST(FaultsFile, InvalidInputIsReportedWithFileLineAndKey) {
  EXPECT_NE(error_of("{fault: camera_blakout}").find("f.yaml:2 (faults[0].fault): unknown fault"),
            std::string::npos);
  EXPECT_NE(error_of("{fault: camera_blakout}").find("camera_blackout"), std::string::npos);
  EXPECT_NE(error_of("{fault: tag_removed}").find("'id' is missing"), std::string::npos);
  EXPECT_NE(error_of("{fault: tag_removed, id: 99}").find("tag36h11:99 is not among the tags of circuit24"),
            std::string::npos);
  EXPECT_NE(error_of("{fault: tag_removed, id: 3, x_m: 2}").find("unknown key 'x_m'"), std::string::npos);
  EXPECT_NE(error_of("{fault: kidnapped, for_s: 3}").find("unknown key 'for_s'"), std::string::npos);
  EXPECT_NE(error_of("{fault: slip_burst, speed_share: 7}").find("speed_share"), std::string::npos);
  EXPECT_NE(error_of("{fault: camera_lost, at_s: -1}").find("at_s"), std::string::npos);
  EXPECT_FALSE(parse_faults("fault: x\n", "f.yaml", circuit()));
}

// Worlds and robots shipped with Waymark must fit together.
struct Shipped {
  const char* world;
  const char* robot;
  std::size_t tags;
};
class ShippedWorld : public ::testing::TestWithParam<Shipped> {};
INSTANTIATE_TEST_SUITE_P(
    Share, ShippedWorld,
    ::testing::Values(Shipped{"circuit24", "limo", 24}, Shipped{"circuit24", "limo-ackermann", 24},
                      Shipped{"circuit24", "limo-stock-driver", 24}, Shipped{"limo-walls", "limo", 24},
                      Shipped{"academy-house", "turtlebot3-waffle", 8}, Shipped{"mbot-square", "mbot", 8}));

TEST_P(ShippedWorld, CanBeDrivenByItsRobot) {
  const auto world = read_world(std::string(WAYMARK_SHARE "/worlds/") + GetParam().world + ".yaml");
  ASSERT_TRUE(world) << to_string(world.error());
  const auto robot = read_robot(std::string(WAYMARK_SHARE "/robots/") + GetParam().robot + ".yaml");
  ASSERT_TRUE(robot) << to_string(robot.error());
  EXPECT_EQ(world->name, GetParam().world);
  EXPECT_EQ(robot->model.name, GetParam().robot);
  EXPECT_EQ(world->tags.tags.size(), GetParam().tags);
  const auto check = check_world(*world, robot->model, robot->camera, robot->simulation.tag_camera);
  ASSERT_TRUE(check);
  std::printf(
      "%s with %s: lap %.2f m, clearance %.3f m, two tags %.1f %%, one %.1f %%, curves %.2f %.2f 1/m\n",
      GetParam().world, GetParam().robot, check->lap_m, check->min_clearance_m,
      100 * check->two_tags_fraction, 100 * check->one_tag_fraction, check->sharpest_left_1_m,
      check->sharpest_right_1_m);
  EXPECT_GT(check->min_clearance_m, 0.15);
  EXPECT_GT(check->one_tag_fraction, 0.3);
}

}  // namespace
}  // namespace waymark

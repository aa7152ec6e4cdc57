#include "waymark/app/doctor/robot_checks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/app/doctor/doctor.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

TEST(NetworkLines, ReportsTheDataOfARobotOnANetwork) {
  const auto level_of = [](const NetworkTraffic& traffic, const std::string& key) {
    for (const DoctorLine& line : network_lines(traffic, "docs"))
      if (line.key == key) return std::string(to_string(line.level));
    return std::string("none");
  };
  NetworkTraffic traffic{
      .odometry = "/odom", .commands = "/cmd_vel", .listened_s = 2, .odometries = 100, .behind_s = 0.004};
  for (const char* key : {"robot", "clock", "commands"}) EXPECT_EQ(level_of(traffic, key), "ok") << key;
  EXPECT_EQ(level_of(traffic, "battery"), "none") << "no battery data arrived";
  traffic.behind_s = -3;
  EXPECT_EQ(level_of(traffic, "clock"), "warn");
  traffic.battery_V = 11;
  EXPECT_EQ(level_of(traffic, "battery"), "ok");
  traffic.battery_share = 0.1;
  EXPECT_EQ(level_of(traffic, "battery"), "warn");
  traffic.others_commands = 20;
  EXPECT_EQ(level_of(traffic, "commands"), "fail");
  traffic.others_commands = 0;
  traffic.silent_publishers = 1;
  traffic.silent_names = "/teleop";
  EXPECT_EQ(level_of(traffic, "commands"), "warn") << "the program may start to send commands";
  const std::string warning = to_text(DoctorReport{network_lines(traffic, "docs")});
  EXPECT_THAT(warning, HasSubstr("/cmd_vel"));
  EXPECT_THAT(warning, HasSubstr("/teleop"));
  testing::expect_on_page("doctor", warning);
  traffic.silent_publishers = 0;
  traffic.has_subscriber = false;
  EXPECT_EQ(level_of(traffic, "commands"), "fail");
  traffic.odometries = 8;
  EXPECT_EQ(level_of(traffic, "robot"), "warn") << "4 Hz";
  traffic.sim_pace = 0.2;
  EXPECT_EQ(level_of(traffic, "robot"), "ok") << "20 Hz of simulated time, on a busy machine";
  traffic.odometries = 0;
  EXPECT_EQ(level_of(traffic, "robot"), "fail");
}

}  // namespace
}  // namespace waymark

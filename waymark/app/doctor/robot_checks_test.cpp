#include "waymark/app/doctor/robot_checks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/app/doctor/doctor.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

TEST(NetworkLines, ReportsTheDataOfARobotOnANetwork) {
  const auto level_of = [](const NetworkHeard& heard, const std::string& key) {
    for (const DoctorLine& line : network_lines(heard, "docs"))
      if (line.key == key) return std::string(to_string(line.level));
    return std::string("none");
  };
  NetworkHeard heard{
      .odometry = "/odom", .commands = "/cmd_vel", .listened_s = 2, .odometries = 100, .behind_s = 0.004};
  for (const char* key : {"robot", "clock", "commands"}) EXPECT_EQ(level_of(heard, key), "ok") << key;
  EXPECT_EQ(level_of(heard, "battery"), "none") << "no battery data arrived";
  heard.behind_s = -3;
  EXPECT_EQ(level_of(heard, "clock"), "warn");
  heard.battery_V = 11;
  EXPECT_EQ(level_of(heard, "battery"), "ok");
  heard.battery_share = 0.1;
  EXPECT_EQ(level_of(heard, "battery"), "warn");
  heard.others_commands = 20;
  EXPECT_EQ(level_of(heard, "commands"), "fail");
  heard.others_commands = 0;
  heard.silent_publishers = 1;
  heard.silent_names = "/teleop";
  EXPECT_EQ(level_of(heard, "commands"), "warn") << "the program may begin to send commands";
  const std::string warning = to_text(DoctorReport{network_lines(heard, "docs")});
  EXPECT_THAT(warning, HasSubstr("/cmd_vel"));
  EXPECT_THAT(warning, HasSubstr("/teleop"));
  testing::expect_on_page("doctor", warning);
  heard.silent_publishers = 0;
  heard.hears_commands = false;
  EXPECT_EQ(level_of(heard, "commands"), "fail");
  heard.odometries = 8;
  EXPECT_EQ(level_of(heard, "robot"), "warn") << "4 Hz";
  heard.sim_pace = 0.2;
  EXPECT_EQ(level_of(heard, "robot"), "ok") << "20 Hz of simulated time, on a busy machine";
  heard.odometries = 0;
  EXPECT_EQ(level_of(heard, "robot"), "fail");
}

}  // namespace
}  // namespace waymark

#include "waymark/config/yaml/commission_record.hpp"

#include <gtest/gtest.h>

#include "tests/support/line_cuts.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"

namespace waymark {
namespace {

const std::string kLimo = *read_text_file(WAYMARK_SHARE "/robots/limo.yaml", 1 << 20);

CommissionRecord record() {
  const RobotModel model = parse_robot(kLimo, "limo.yaml")->model;
  return {.passed = true,
          .date = "2026-11-23",
          .version = "0.1.0",
          .robot = "process:python3 \"my robot.py\" # slow",
          .topics = digest_of("topics"),
          .limits = model.limits,
          .wheel_radius_m = model.wheel_radius_m,
          .track_m = model.track_m,
          .failed = {"odometry.yaw_rad"},
          .figures = {.response_s = 0.12, .stopping_m = 0.03}};
}

TEST(CommissionRecord, IsStoredInTheRobotFileAndReadsBack) {
  const auto text = with_commission(kLimo, record());
  ASSERT_TRUE(text) << to_string(text.error());
  EXPECT_TRUE(text->starts_with(kLimo)) << "comments and everything else are unchanged";
  EXPECT_TRUE(parse_robot(*text, "limo.yaml"));
  const auto back = parse_commission(*text, "limo.yaml");
  ASSERT_TRUE(back) << to_string(back.error());
  ASSERT_TRUE(*back);
  EXPECT_TRUE((*back)->passed);
  EXPECT_EQ((*back)->robot, record().robot);
  EXPECT_EQ((*back)->topics, record().topics);
  EXPECT_EQ((*back)->failed, record().failed);
  EXPECT_EQ((*back)->figures.response_s, 0.12);
  EXPECT_EQ((*back)->figures.stopping_m, 0.03);
  EXPECT_FALSE((*back)->figures.stopping_s);
  EXPECT_FALSE(*parse_commission(kLimo, "limo.yaml"));
}

TEST(CommissionRecord, ReplacesThePreviousRecord) {
  CommissionRecord second = record();
  second.date = "2026-12-01";
  second.failed = {};
  const std::string once = *with_commission(kLimo, record());
  const std::string twice = *with_commission(once + "motion: {}\n", second);
  EXPECT_EQ(twice, *with_commission(kLimo + "motion: {}\n", second));
  EXPECT_FALSE(with_commission("{name: x, commissioned: {passed: true}}", second)) << "not in block style";
}

TEST(CommissionRecord, RejectsCutsAtLineEnds) {
  const std::string text = *with_commission("", record());
  for (const std::string& cut : testing::cuts_at_line_ends(text)) {
    const auto read = parse_commission(cut, "r.yaml");
    EXPECT_TRUE(!read || !*read) << cut;
  }
  const std::string robot = to_yaml(*parse_robot(kLimo, "limo.yaml"));
  const std::string driven = *with_commission(robot, record());
  EXPECT_TRUE(driven.ends_with("\nend: 1\n")) << "the record precedes the last key";
  EXPECT_EQ(*with_commission(driven, record()), driven);
  const auto back = parse_robot(driven, "r.yaml");
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_TRUE(back->commissioned);
  for (const std::string& cut : testing::cuts_at_line_ends(driven))
    EXPECT_FALSE(parse_robot(cut, "r.yaml")) << cut;
}

TEST(CommissionRecord, IsInvalidAfterChangesOfTheRobot) {
  const RobotModel model = parse_robot(kLimo, "limo.yaml")->model;
  const CommissionGround ground{.robot = record().robot, .topics = record().topics};
  EXPECT_TRUE(changes_since(record(), model, ground).empty());
  RobotModel faster = model;
  faster.limits.speed_m_s = 2;
  EXPECT_EQ(changes_since(record(), faster, ground),
            std::vector<std::string>{"limits.speed_m_s changed from 1 to 2"});
  RobotModel wider = model;
  wider.track_m = 0.2;
  EXPECT_EQ(changes_since(record(), wider, ground).size(), 1U);
  RobotModel moved = model;
  moved.base_T_cam = SE3();
  EXPECT_TRUE(changes_since(record(), moved, ground).empty()) << "a moved camera does not affect the wheels";
  EXPECT_NE(changes_since(record(), model, {.robot = "ros2:limo"}).at(0).find("to ros2:limo"),
            std::string::npos);
  EXPECT_NE(changes_since(record(), model, {.robot = ground.robot, .topics = "other"}).at(0).find("topics"),
            std::string::npos);
}

TEST(CommissionRecord, ErrorsContainTheKey) {
  for (const char* wrong :
       {"commissioned: 3\n", "commissioned: {passed: perhaps}\n", "commissioned: {pased: true}\n"}) {
    const auto read = parse_commission(wrong, "r.yaml");
    ASSERT_FALSE(read) << wrong;
    EXPECT_EQ(read.error().place.source, "r.yaml");
    EXPECT_NE(to_string(read.error()).find("commissioned"), std::string::npos) << to_string(read.error());
    EXPECT_FALSE(parse_robot(kLimo + wrong, "r.yaml")) << wrong;
  }
}

}  // namespace
}  // namespace waymark

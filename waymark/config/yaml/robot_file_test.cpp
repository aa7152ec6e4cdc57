#include "waymark/config/yaml/robot_file.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/line_cuts.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

const std::string kLimo = *read_text_file(WAYMARK_SHARE "/robots/limo.yaml", 1 << 20);

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

std::string error_of(const std::string& text) {
  const auto robot = parse_robot(text, "r.yaml");
  return robot ? "none" : to_string(robot.error());
}

TEST(RobotFile, TheLimoMatchesItsDataSheet) {
  const auto limo = parse_robot(kLimo, "limo.yaml");
  ASSERT_TRUE(limo) << to_string(limo.error());
  EXPECT_EQ(limo->model.name, "limo");
  EXPECT_EQ(limo->model.hull.width_m, 0.22);
  EXPECT_EQ(limo->camera.width_px(), 640);
  // Points straight ahead project to the image centre, and points on the left project to the left of it.
  const SE3 cam_T_base = limo->model.base_T_cam.inverse();
  const Eigen::Vector3d ahead = cam_T_base * Eigen::Vector3d(2.084, 0, 0.18);
  EXPECT_TRUE(ahead.isApprox(Eigen::Vector3d(0, 0, 2), 1e-12));
  EXPECT_LT((cam_T_base * Eigen::Vector3d(2, 1, 0)).x(), 0);
  const auto& pinhole = std::get<PinholeRadtan>(limo->camera.projection());
  EXPECT_EQ(pinhole.cx, 323.5) << "half a pixel more than in the file: centres at +1/2";
}

TEST(RobotFile, RoundTrips) {
  for (const char* angles :
       {"roll_deg: 0.0, pitch_deg: 0.0, yaw_deg: 0.0", "roll_deg: 3, pitch_deg: 20, yaw_deg: -100",
        "roll_deg: 0, pitch_deg: 90, yaw_deg: 7"}) {
    const std::string text = replaced(kLimo, "roll_deg: 0.0, pitch_deg: 0.0, yaw_deg: 0.0", angles);
    const auto robot = parse_robot(text, "limo.yaml");
    ASSERT_TRUE(robot) << to_string(robot.error());
    const auto back = parse_robot(to_yaml(*robot), "written");
    ASSERT_TRUE(back) << to_string(back.error());
    EXPECT_EQ(back->camera, robot->camera);
    EXPECT_EQ(back->model.name, robot->model.name);
    EXPECT_EQ(back->model.hull.front_m, robot->model.hull.front_m);
    EXPECT_EQ(back->model.limits.yaw_rate_rad_s, robot->model.limits.yaw_rate_rad_s);
    EXPECT_EQ(back->model.track_m, robot->model.track_m);
    EXPECT_LT((back->model.base_T_cam.inverse() * robot->model.base_T_cam).log().norm(), 1e-7);
  }
}

const std::string kTwoCameras = *read_text_file(WAYMARK_SHARE "/robots/limo-front-rear.yaml", 1 << 20);

TEST(RobotFile, EachCameraHasItsNameLensAndMounting) {
  const std::string text = replaced(kTwoCameras, "[442.17, 0.0, 323.0", "[500.0, 0.0, 323.0");
  const auto robot = parse_robot(text, "two.yaml");
  ASSERT_TRUE(robot) << to_string(robot.error());
  EXPECT_EQ(robot->camera_name, "front");
  EXPECT_EQ(std::get<PinholeRadtan>(robot->camera.projection()).fx, 500);
  ASSERT_EQ(robot->more_cameras.size(), 1U);
  const MountedCamera& rear = robot->more_cameras[0];
  EXPECT_EQ(rear.name, "rear");
  EXPECT_EQ(std::get<PinholeRadtan>(rear.camera.projection()).fx, 442.17);
  const Eigen::Vector3d behind = rear.base_T_cam.inverse() * Eigen::Vector3d(-2.13, 0, 0.2);
  EXPECT_TRUE(behind.isApprox(Eigen::Vector3d(0, 0, 2), 1e-12)) << "it looks backward";

  const auto back = parse_robot(to_yaml(*robot), "written");
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_EQ(back->camera_name, "front");
  EXPECT_EQ(back->camera, robot->camera);
  ASSERT_EQ(back->more_cameras.size(), 1U);
  EXPECT_EQ(back->more_cameras[0].camera, rear.camera);
  EXPECT_LT((back->more_cameras[0].base_T_cam.inverse() * rear.base_T_cam).log().norm(), 1e-7);

  const SE3 moved(robot->model.base_T_cam.rotation(), {0.1, 0.02, 0.3});
  const auto changed = with_camera_mounting(kTwoCameras, moved);
  ASSERT_TRUE(changed) << to_string(changed.error());
  const auto elsewhere = parse_robot(*changed, "changed");
  ASSERT_TRUE(elsewhere) << to_string(elsewhere.error());
  EXPECT_TRUE(elsewhere->model.base_T_cam.translation().isApprox(moved.translation(), 1e-9));
  EXPECT_EQ(elsewhere->more_cameras[0], parse_robot(kTwoCameras, "two")->more_cameras[0]);
}

TEST(RobotFile, RejectsCutsAtLineEnds) {
  for (const std::string& text : {kLimo, kTwoCameras}) {
    const std::string written = to_yaml(*parse_robot(text, "share"));
    ASSERT_TRUE(parse_robot(written, "written"));
    for (const std::string& cut : testing::cuts_at_line_ends(written))
      EXPECT_FALSE(parse_robot(cut, "written")) << cut;
  }
}

TEST(RobotFile, RejectsInvalidCameraNamesAndLists) {
  EXPECT_NE(
      error_of(replaced(kTwoCameras, "name: rear", "name: front")).find("duplicate camera name 'front'"),
      std::string::npos);
  EXPECT_NE(error_of(replaced(kTwoCameras, "name: rear", "name: ../rear")).find("'../rear'"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(kTwoCameras, "- name: rear", "- nam: rear")).find("Did you mean 'name'"),
            std::string::npos);
  EXPECT_NE(error_of(kLimo + "cameras: []\n").find("list 'cameras'"), std::string::npos);
  EXPECT_NE(
      error_of(replaced(kTwoCameras, kTwoCameras.substr(kTwoCameras.find("\ncameras:")), "\ncameras: []\n"))
          .find("is not a list of 1 to 16 cameras"),
      std::string::npos);
}

TEST(RobotFile, InvalidInputIsReportedWithFileLineAndKey) {
  EXPECT_NE(error_of(replaced(kLimo, "front_m", "frnt_m")).find("r.yaml:4 (hull.frnt_m): unknown key"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(kLimo, "0.045", "0")).find("(wheels.radius_m): 0 is not greater than 0"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(kLimo, "0.161", "1e300")).find("out of all proportion"), std::string::npos);
  EXPECT_NE(error_of(replaced(kLimo, "x_m: 0.084", "x_m: front")).find("'front' is not a number"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(kLimo, "image_width: 640\n", "image_width: 0\n")).find("camera_info"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(kLimo, "width_m: 0.22", "width_m: 220")).find("220 m exceeds"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(kLimo, "x_m: 0.084", "x_m: 84")).find("84"), std::string::npos);
  EXPECT_NE(error_of(kLimo + "motion:\n  foo: 3\n").find("(motion.foo): unknown key"), std::string::npos);
  EXPECT_NE(error_of("name: x\n").find("'hull' is missing"), std::string::npos);
  const std::size_t needed = kLimo.find("rectification_matrix");  // the rest is optional
  for (std::size_t length = 0; length + 20 < needed; length += 7)
    EXPECT_FALSE(parse_robot(kLimo.substr(0, length), "r.yaml")) << length;
}

TEST(RobotList, ReadsEveryRobotThatComesWithWaymark) {
  const auto robots = list_shared("robots");
  ASSERT_TRUE(robots) << to_string(robots.error());
  ASSERT_GE(robots->size(), 6U);
  for (const ListedFile& listed : *robots) {
    const auto shown = read_commented_robot(listed.path);
    ASSERT_TRUE(shown) << to_string(shown.error());
    EXPECT_EQ(shown->robot.model.name, listed.name) << "the file name is the name of the robot";
    EXPECT_EQ(read_named_robot(listed.name)->model.name, listed.name);
    EXPECT_GT(first_sentence(shown->comment).size(), 20U) << listed.name;
  }
  EXPECT_FALSE(read_named_robot("no such robot"));
  EXPECT_TRUE(std::ranges::is_sorted(*robots, {}, &ListedFile::name));
}

TEST(RobotList, AMissingFolderIsAnError) { EXPECT_FALSE(list_shared("no such folder")); }

TEST(RobotList, JoinsTheLeadingComment) {
  const std::string text =
      leading_comment("# A robot of 1.5 m.\r\n#  It drives.\n#\n# Well.\nname: x\n# no\n");
  EXPECT_EQ(text, "A robot of 1.5 m. It drives. Well.");
  EXPECT_EQ(first_sentence(text), "A robot of 1.5 m.");
  EXPECT_EQ(leading_comment("name: x\n"), "");
  EXPECT_EQ(leading_comment("#"), "");
  EXPECT_EQ(first_sentence("no end"), "no end");
}

}  // namespace
}  // namespace waymark

// Tests only the text; tests/gazebo/world_test.py checks that SDFormat can read it.
#include "waymark/sdf/write_sdf.hpp"

#include <cstdio>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/yaml/world_file.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

using ::testing::IsEmpty;

using ::testing::Not;

TEST(SdfText, APoseRoundTrips) {
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    const SE3 pose(SO3::exp({random.normal(), random.normal(), random.normal()}), {random.normal(), 2, -3});
    double x = 0, y = 0, z = 0, roll = 0, pitch = 0, yaw = 0;
    ASSERT_EQ(std::sscanf(sdf_text::pose(pose).c_str(), "<pose>%lf %lf %lf %lf %lf %lf</pose>", &x, &y, &z,
                          &roll, &pitch, &yaw),
              6);
    EXPECT_LT((Eigen::Vector3d(x, y, z) - pose.translation()).norm(), 1e-5);
    EXPECT_LT((SO3::from_rpy(roll, pitch, yaw).inverse() * pose.rotation()).log().norm(), 1e-7);
  }
}

TEST(SdfText, NamesDoNotBreakTheXml) {
  const std::string model = sdf_text::fixed_model("a<b>&'c'", SE3(), sdf_text::solid("x\"y", SE3(), "", 0.5));
  EXPECT_THAT(model, Not(HasSubstr("a<b>")));
  EXPECT_THAT(model, HasSubstr("&lt;b&gt;&amp;"));
  EXPECT_THAT(model, HasSubstr("<static>true</static>"));
  std::size_t quotes = 0;
  for (const char c : model) quotes += c == '\'' ? 1 : 0;
  EXPECT_EQ(quotes % 2, 0U) << model;
}

TEST(SdfText, GreyHasEqualColours) {
  EXPECT_THAT(sdf_text::grey(0.25), HasSubstr("<diffuse>0.250 0.250 0.250 1</diffuse>"));
  EXPECT_EQ(sdf_text::box({1, 2, 3}),
            "<geometry><box><size>1.000000 2.000000 3.000000</size></box></geometry>");
}

RobotDescription robot_named(const char* name) {
  return read_robot(find_shared("robots", name).value()).value();
}

World world_named(const char* name) { return read_world(find_shared("worlds", name).value()).value(); }

std::size_t count(const std::string& text, const std::string& piece) {
  std::size_t number = 0;
  for (std::size_t at = text.find(piece); at != std::string::npos; at = text.find(piece, at + 1)) ++number;
  return number;
}

TEST(WriteSdfWorld, EachTagIsAnImageAndEachSideOfABoardAPlane) {
  const World world = world_named("academy-house");  // has boards that are printed on both sides
  const SdfFiles files = write_sdf_world(world, robot_named("limo-gazebo"));
  EXPECT_EQ(files.textures.size(), world.tags.tags.size());
  EXPECT_EQ(count(files.world, "<albedo_map>"), 2 * world.tags.tags.size());
  EXPECT_EQ(count(files.world, "<model name='board_"), world.tags.tags.size());
  EXPECT_EQ(count(files.world, "<model name='box_"), world.walls.size() + world.occluders.size());
  EXPECT_THAT(files.notes, IsEmpty());
  for (const SdfTexture& texture : files.textures) {
    EXPECT_THAT(files.world, HasSubstr(texture.name));
    EXPECT_EQ(texture.image.width(), texture.image.height());
    EXPECT_EQ(texture.image.row(0)[0], 255) << "white margin";
  }
  EXPECT_EQ(write_sdf_world(world, robot_named("limo-gazebo")).world, files.world)
      << "the output is deterministic";
}

TEST(WriteSdfWorld, NamesInvalidInXmlOrTopicsAreReplaced) {
  World world = world_named("circuit24");
  world.name = "a <b> & 'c' -- d";
  RobotDescription robot = robot_named("limo-gazebo");
  robot.model.name = "my robot/2";
  const SdfFiles files = write_sdf_world(world, robot);
  EXPECT_THAT(files.world, HasSubstr("<world name='a__b_____c_____d'>"));
  EXPECT_THAT(files.world, HasSubstr("<topic>/model/my_robot_2/cmd_vel</topic>"));
  EXPECT_THAT(gazebo_profile_of(robot, "robot.yaml"), HasSubstr("command_topic: /model/my_robot_2/cmd_vel"));
  EXPECT_EQ(sdf_model_name(""), "robot");
}

TEST(WriteSdfWorld, NotesWhatGazeboCannotShow) {
  std::vector<std::string> notes;
  const std::string two_cameras = write_sdf_robot(robot_named("limo-front-rear"), SE3(), notes);
  EXPECT_EQ(count(two_cameras, "type='camera'"), 1U);
  ASSERT_GE(notes.size(), 2U);
  for (const std::string& note : notes) testing::expect_on_page("world", note);
}

TEST(WriteSdfWorld, WritesALidarOnlyIfTheRobotHasOne) {
  std::vector<std::string> notes;
  RobotDescription robot = robot_named("limo-gazebo");
  robot.simulation.lidar.rate_hz = 0;
  EXPECT_THAT(write_sdf_robot(robot, SE3(), notes), Not(HasSubstr("gpu_lidar")));
  EXPECT_THAT(gazebo_profile_of(robot, "r.yaml"), Not(HasSubstr("scan_topic")));
  robot.simulation.lidar.rate_hz = 10;
  EXPECT_THAT(write_sdf_robot(robot, SE3(), notes), HasSubstr("<samples>360</samples>"));
  EXPECT_THAT(gazebo_profile_of(robot, "r.yaml"), HasSubstr("scan_topic: /scan"));
}

}  // namespace
}  // namespace waymark

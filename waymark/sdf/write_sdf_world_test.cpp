// The text alone; that SDFormat reads it, and what it says then, is tests/gazebo/world_test.py.
#include "waymark/sdf/write_sdf_world.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/config/share.hpp"
#include "waymark/config/world_file.hpp"
#include "waymark/sdf/write_sdf_robot.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

RobotDescription robot_named(const char* name) {
  return read_robot(find_shared("robots", name).value()).value();
}
World world_named(const char* name) { return read_world(find_shared("worlds", name).value()).value(); }

std::size_t count(const std::string& text, const std::string& piece) {
  std::size_t number = 0;
  for (std::size_t at = text.find(piece); at != std::string::npos; at = text.find(piece, at + 1)) ++number;
  return number;
}

TEST(WriteSdfWorld, EachTagIsAPictureAndEachSideOfABoardAPlane) {
  const World world = world_named("academy-house");  // boards that are printed on both sides
  const SdfFiles files = write_sdf_world(world, robot_named("limo-gazebo"));
  EXPECT_EQ(files.textures.size(), world.tags.tags.size());
  EXPECT_EQ(count(files.world, "<albedo_map>"), 2 * world.tags.tags.size());
  EXPECT_EQ(count(files.world, "<model name='board_"), world.tags.tags.size());
  EXPECT_EQ(count(files.world, "<model name='box_"), world.walls.size() + world.occluders.size());
  EXPECT_THAT(files.notes, IsEmpty());
  for (const SdfTexture& texture : files.textures) {
    EXPECT_THAT(files.world, HasSubstr(texture.name));
    EXPECT_EQ(texture.image.width(), texture.image.height());
    EXPECT_EQ(texture.image.row(0)[0], 255) << "white paper around";
  }
  EXPECT_EQ(write_sdf_world(world, robot_named("limo-gazebo")).world, files.world)
      << "the same bytes each time";
}

TEST(WriteSdfWorld, NamesThatXmlOrTopicsDoNotTakeAreMended) {
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

TEST(WriteSdfWorld, WhatGazeboCannotShowIsNoted) {
  std::vector<std::string> notes;
  const std::string two_cameras = write_sdf_robot(robot_named("limo-front-rear"), SE3(), notes);
  EXPECT_EQ(count(two_cameras, "type='camera'"), 1U);
  EXPECT_THAT(notes, ::testing::Contains(HasSubstr("only the first of the cameras")));
  EXPECT_THAT(notes, ::testing::Contains(HasSubstr("not the pinhole that Gazebo renders")));
}

TEST(WriteSdfWorld, ALidarIsThereWhereTheRobotHasOne) {
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

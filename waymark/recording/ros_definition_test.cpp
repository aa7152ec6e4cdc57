#include "waymark/recording/ros_definition.hpp"

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/recording/cdr_channels.hpp"

namespace waymark {
namespace {

constexpr std::string_view kHeader =
    "================================================================================\n"
    "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

TEST(RosDefinition, KeepsFieldsThatRos2HasUnchanged) {
  const std::string text =
      "# words\nHeader header\nint32 A=5 # of course\nstring B= x # y\nfloat64[3] v\nuint8[] data\nduration "
      "d\nbyte b\n" +
      std::string(kHeader);
  const auto transcoder = ros::Ros1Transcoder::make("pkg_msgs/Type", text);
  ASSERT_TRUE(transcoder) << to_string(transcoder.error());
  EXPECT_EQ(transcoder->type(), "pkg_msgs/msg/Type");
  const std::string& schema = transcoder->schema();
  EXPECT_TRUE(
      schema.starts_with("int32 A=5\nstring B=\"x # y\"\nstd_msgs/Header header\nfloat64[3] v\nuint8[] data\n"
                         "builtin_interfaces/Duration d\nint8 b\n"))
      << schema;
  EXPECT_EQ(schema.find("seq"), std::string::npos);
  EXPECT_NE(schema.find("MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"), std::string::npos);
}

TEST(RosDefinition, TypesHaveTheirNamesInRos2) {
  EXPECT_EQ(ros::ros2_type("geometry_msgs/Pose"), "geometry_msgs/msg/Pose");
  EXPECT_EQ(ros::ros2_type("tf2_msgs/TFMessage"), "tf2_msgs/msg/TFMessage");
  EXPECT_EQ(ros::ros2_type("tf/tfMessage"), "tf2_msgs/msg/TFMessage");
}

TEST(RosDefinition, RejectsInvalidDefinitions) {
  for (const char* text : {"Foo foo\n", "uint8[x] a\n", "uint8[3 a\n", "uint8\n", "uint8[99999999999] a\n"}) {
    const auto parsed = ros::parse_definition("pkg/Type", text);
    ASSERT_FALSE(parsed) << text;
    EXPECT_EQ(parsed.error().place.line, 1) << text;
  }
  const auto recursive = ros::parse_definition(
      "pkg/Type", "A a\n====================\nMSG: pkg/A\nB b\n====================\nMSG: pkg/B\nA a\n");
  ASSERT_FALSE(recursive);
  EXPECT_EQ(recursive.error().code, ErrorCode::Unreadable);
  testing::expect_on_page("recording", recursive.error());
}

}  // namespace
}  // namespace waymark

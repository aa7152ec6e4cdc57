#include "waymark/robots/dds/ros_names.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(RosNames, MapToDdsAndBack) {
  const BusTopic odom = dds_topic("/odom", "nav_msgs/msg/Odometry");
  EXPECT_EQ(odom.topic, "rt/odom");
  EXPECT_EQ(odom.type, "nav_msgs::msg::dds_::Odometry_");
  const auto back = ros_topic(dds_topic("/camera/color/image_raw", "sensor_msgs/msg/Image"));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->topic, "/camera/color/image_raw");
  EXPECT_EQ(back->type, "sensor_msgs/msg/Image");
  EXPECT_EQ(dds_topic("odom", "a/msg/B").topic, "rt/odom") << "leading slash is optional";
  const ServiceTopics stop = dds_service("/waymark/stop", "std_srvs/srv/Trigger");
  EXPECT_EQ(stop.request.topic, "rq/waymark/stopRequest");
  EXPECT_EQ(stop.request.type, "std_srvs::srv::dds_::Trigger_Request_");
  EXPECT_EQ(stop.reply.topic, "rr/waymark/stopReply");
  EXPECT_EQ(stop.reply.type, "std_srvs::srv::dds_::Trigger_Response_");
  for (const BusTopic& none :
       {BusTopic{"ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"},
        BusTopic{"rt/x", "Square"}, stop.request, BusTopic{}})
    EXPECT_FALSE(ros_topic(none)) << none.topic;
}

TEST(RosNames, AcceptsTheTopicNamesThatRosAccepts) {
  for (const char* right : {"/odom", "odom", "/r1/camera_2/image_raw", "_a", "/a/_2"})
    EXPECT_TRUE(is_topic_name(right)) << right;
  for (const char* wrong : {"", "/", "/a b", "//a", "/a/", "/a//b", "/2a", "/a/2b", "/a-b", "/\xc3\xa9"})
    EXPECT_FALSE(is_topic_name(wrong)) << wrong;
}

}  // namespace
}  // namespace waymark

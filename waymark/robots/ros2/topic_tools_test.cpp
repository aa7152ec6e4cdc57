#include "waymark/robots/ros2/topic_tools.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

TEST(MessageText, ShowsEveryField) {
  Odometry odometry{.stamp = SensorTime(std::chrono::milliseconds(12500)), .odom_T_base = SE2(1.25, -2, 0)};
  odometry.speed_m_s = 0.5;
  const auto text = message_text(ros2::Odometry::kType, cdr::encode(ros2::to_ros(odometry)));
  ASSERT_TRUE(text) << to_string(text.error());
  for (const char* line :
       {"header:\n  stamp:\n    sec: 12\n    nanosec: 500000000\n  frame_id: 'odom'\n",
        "child_frame_id: 'base_link'\n", "      x: 1.25\n      y: -2\n", "      x: 0.5\n", "# 36 in all"})
    EXPECT_NE(text->find(line), std::string::npos) << line << "\n" << *text;
  const auto image =
      message_text(ros2::Image::kType, cdr::encode(ros2::to_ros(CameraFrame{.image = Image(64, 64)})));
  ASSERT_TRUE(image);
  EXPECT_NE(image->find("# 4096 in all"), std::string::npos) << *image;
  EXPECT_LT(image->size(), 500U);
}

TEST(MessageText, RejectsUnknownTypesAndTruncatedData) {
  const auto bytes = cdr::encode(ros2::to_ros(Odometry{}));
  EXPECT_FALSE(message_text("my_msgs/msg/Own", bytes));
  EXPECT_FALSE(message_text(ros2::Odometry::kType, std::span(bytes).first(40)));
  EXPECT_FALSE(message_text(ros2::Odometry::kType, {}));
  std::vector<std::uint8_t> names = {0, 1, 0, 0};
  names.resize(200, 0xff);  // a list of 4 billion transforms
  EXPECT_FALSE(message_text(ros2::TFMessage::kType, names));
  EXPECT_FALSE(message_text(ros2::Joy::kType, names));
}

TEST(TopicTools, ListPublishersAndSubscriptions) {
  const BusTopic odom = dds_topic("/odom", "nav_msgs/msg/Odometry");
  const auto topics = list_topics({{true, odom, {}, {}},
                                   {false, odom, {.reliable = false}, {}},
                                   {false, odom, {}, {}},
                                   {true, {"other", "Thing"}, {}, {}}});
  ASSERT_EQ(topics.size(), 1U);
  EXPECT_EQ(topics[0].publishers, 1);
  EXPECT_EQ(topics[0].subscriptions, 2);
  EXPECT_EQ(topics[0].offered, "reliable");
}

TEST(TopicTools, MeasureTheRateOfMessages) {
  RateCounter counter;
  EXPECT_EQ(counter.text(), "no message");
  for (int i = 0; i <= 100; ++i) counter.add(milliseconds(20 * i), 1000);
  EXPECT_DOUBLE_EQ(counter.rate_hz(), 50);
  EXPECT_EQ(counter.text(), "50.00 Hz, 0.050 MB/s, 20.0 ms apart (from 20.0 to 20.0), 101 messages");
}

}  // namespace
}  // namespace waymark

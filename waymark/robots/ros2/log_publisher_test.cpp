#include "waymark/robots/ros2/log_publisher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/offered_qos.hpp"
#include "waymark/robots/dds/ros_environment.hpp"
#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/ros2/other_publishers.hpp"

namespace waymark {
namespace {

/// A network on which one program has been discovered.
class OneProgram final : public Bus {
 public:
  Result<std::size_t> advertise(const BusTopic& topic, const TopicQos& /*qos*/) override {
    advertised.push_back(topic.type);
    return advertised.size() - 1;
  }
  Result<std::size_t> subscribe(const BusTopic& /*topic*/, const TopicQos& /*qos*/) override { return 0U; }
  void unsubscribe(std::size_t /*subscription*/) override {}
  Status publish(std::size_t /*publisher*/, std::span<const std::uint8_t> bytes) override {
    sent.emplace_back(bytes.begin(), bytes.end());
    return {};
  }
  Status reply(std::size_t /*publisher*/, std::span<const std::uint8_t> /*bytes*/,
               const RequestIdentity& /*to*/) override {
    return {};
  }
  std::optional<BusMessage> next(Duration /*most*/) override { return std::nullopt; }
  [[nodiscard]] bool more() const override { return false; }
  [[nodiscard]] int matched_subscriptions(std::size_t /*publisher*/) const override { return 0; }
  [[nodiscard]] int matched_publishers(std::size_t /*subscription*/) const override { return 0; }
  [[nodiscard]] std::uint64_t dropped(std::size_t /*subscription*/) const override { return 0; }
  [[nodiscard]] std::vector<BusEndpoint> endpoints() const override {
    const BusTopic commands = dds_topic("/cmd_vel", "geometry_msgs/msg/Twist");
    return {
        {true, commands, {}, Guid{1}}, {false, commands, {}, Guid{2}}, {true, {"rt/odom", ""}, {}, Guid{3}}};
  }
  [[nodiscard]] std::vector<std::string> participants() const override { return {program}; }
  [[nodiscard]] std::string participant_of(const Guid& /*endpoint*/) const override { return program; }

  std::string program = "teleop";
  std::vector<std::string> advertised{};  ///< types that have been advertised
  std::vector<std::vector<std::uint8_t>> sent{};
};

TEST(LogPublisher, PublishesCommandsAsTheSubscribedType) {
  OneProgram bus;  // subscribes to Twist
  LogPublisher publisher(bus, true);
  const LogChannel recorded{
      .topic = "/cmd_vel", .type = std::string(ros2::TwistStamped::kType), .encoding = "cdr"};
  const auto stamped = cdr::encode(ros2::to_ros(StampedCommand{.command = {0.25, -0.5}}));
  ASSERT_TRUE(publisher.publish(recorded, {.data = stamped}));
  ASSERT_EQ(bus.advertised, (std::vector<std::string>{"geometry_msgs::msg::dds_::Twist_"}));
  const auto twist = cdr::decode<ros2::Twist>(bus.sent.at(0));
  ASSERT_TRUE(twist) << to_string(twist.error());
  EXPECT_EQ(twist->linear.x, 0.25);
  EXPECT_EQ(twist->angular.z, -0.5);
  const auto reports = publisher.take_reports();
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_TRUE(reports[0].starts_with("/cmd_vel ")) << reports[0];
  testing::expect_on_page("robots", reports[0]);
  ASSERT_TRUE(publisher.stop());
  EXPECT_TRUE(cdr::decode<ros2::Twist>(bus.sent.back())) << "zero, with the same type";
  const LogChannel other{
      .topic = "/other", .type = std::string(ros2::TwistStamped::kType), .encoding = "cdr"};
  ASSERT_TRUE(publisher.publish(other, {.data = stamped}));
  EXPECT_EQ(bus.advertised.back(), "geometry_msgs::msg::dds_::TwistStamped_")
      << "the recorded type, because there is no subscription";
  const LogChannel odometry{.topic = "/odom", .type = std::string(ros2::Odometry::kType), .encoding = "cdr"};
  const Status alone = check_no_other_publisher({recorded, odometry}, false, bus);
  ASSERT_FALSE(alone);
  EXPECT_EQ(alone.error().place.source, "ROS 2");
  EXPECT_NE(alone.error().message.find("/odom"), std::string::npos) << alone.error().message;
  EXPECT_NE(alone.error().message.find("teleop"), std::string::npos) << alone.error().message;
  testing::expect_on_page("robots", alone.error());
  EXPECT_TRUE(check_no_other_publisher({recorded}, false, bus)) << "commands are not played";
  EXPECT_FALSE(check_no_other_publisher({recorded}, true, bus));
}

TEST(LogPublisher, KeepsTransientLocalTopicsForLateJoiners) {
  const auto kept = [](const char* topic, std::string_view type, const std::string& offered) {
    return is_kept_for_late_joiners(
        {.topic = topic, .type = std::string(type), .metadata = {{"offered_qos_profiles", offered}}});
  };
  EXPECT_TRUE(kept("/tf_static", "tf2_msgs/msg/TFMessage", ""));
  EXPECT_TRUE(kept("/camera/camera_info", ros2::CameraInfo::kType, ""));
  EXPECT_FALSE(kept("/odom", ros2::Odometry::kType, ""));
  EXPECT_FALSE(
      kept("/odom", ros2::Odometry::kType, to_yaml({OfferedQos{.durability = 2}}, QosNotation::Names)));
  for (const QosNotation notation : {QosNotation::Numbers, QosNotation::Names})
    EXPECT_TRUE(kept("/map", "nav_msgs/msg/OccupancyGrid", to_yaml({OfferedQos{.durability = 1}}, notation)));
}

TEST(PublisherNames, PreferTheNamesOfNodes) {
  OneProgram bus;
  EXPECT_EQ(publishers_of(dds_topic("/cmd_vel", "geometry_msgs/msg/Twist"), bus), (std::set<Guid>{Guid{1}}));
  for (const char* distro : {"humble", "jazzy"}) {
    PublisherNames names;
    names.add(ros_node_description(distro, "nav2")->bytes({.publishers = {Guid{1}, Guid{5}}}));
    EXPECT_EQ(names.of({Guid{1}, Guid{5}}, bus), "/nav2") << distro;
    EXPECT_EQ(names.of({Guid{1}, Guid{7}}, bus), "/nav2, teleop") << distro;
  }
  PublisherNames none;
  std::vector<std::uint8_t> hostile = {0, 1, 0, 0};
  hostile.resize(100, 0xff);
  none.add(hostile);
  EXPECT_EQ(none.of({Guid{1}}, bus), "teleop");
  bus.program = "/";  // the enclave, which is the participant name of all ROS programs
  EXPECT_EQ(none.of({Guid{1}}, bus), "");
}

}  // namespace
}  // namespace waymark

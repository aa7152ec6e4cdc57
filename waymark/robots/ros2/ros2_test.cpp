#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/offered_qos.hpp"
#include "waymark/robots/dds/ros_graph.hpp"
#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/ros2/log_publisher.hpp"
#include "waymark/robots/ros2/message_text.hpp"
#include "waymark/robots/ros2/profile.hpp"
#include "waymark/robots/ros2/publisher_names.hpp"
#include "waymark/robots/ros2/relay.hpp"
#include "waymark/robots/ros2/topic_tools.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

TEST(Ros2Profile, ThoseThatComeWithWaymarkAreRead) {
  for (const char* name :
       {"limo", "turtlebot3", "turtlebot3-waffle-pi", "turtlebot3-burger", "limo-sim", "limo-sim-tags"}) {
    const auto profile = find_ros2_profile(name);
    ASSERT_TRUE(profile) << to_string(profile.error());
    const auto uses = uses_of(*profile);
    EXPECT_GE(uses.size(), 4U);
    EXPECT_TRUE(uses.front().publishes);
    EXPECT_TRUE(uses.front().qos.reliable) << "a node that asks for reliable commands hears them";
  }
  EXPECT_EQ(command_use(find_ros2_profile("turtlebot3").value()).name.type,
            "geometry_msgs::msg::dds_::TwistStamped_");
}

TEST(Ros2Profile, SaysWhatIsWrong) {
  const auto error = [](const char* text) { return to_string(parse_ros2_profile(text, "my.yaml").error()); };
  EXPECT_NE(error("odometry_topic: ''\n").find("odometry_topic"), std::string::npos);
  EXPECT_NE(error("command_topic: ''\n").find("command_topic"), std::string::npos);
  EXPECT_NE(error("odom_topic: /odom\n").find("odometry_topic"), std::string::npos) << "the nearest key";
  EXPECT_NE(error("image_topic: /a\ncompressed_image_topic: /b\n").find("exclude"), std::string::npos);
  EXPECT_NE(error("odometry_topic: /my odom\n").find("'/my odom' is no name of a topic"), std::string::npos);
  EXPECT_NE(error("imu_topic: /odom\n").find("'/odom' is the topic of "), std::string::npos);
  EXPECT_NE(error("imu_topic: odom\n").find("'odom' is the topic of "), std::string::npos)
      << "with and without the slash";
  EXPECT_NE(error("").find("this profile is empty"), std::string::npos);
  EXPECT_EQ(error("- limo\n- /odom\n").find("is empty"), std::string::npos) << error("- limo\n");
  EXPECT_NE(error("# my robot\n").find("this profile is empty"), std::string::npos);
  EXPECT_FALSE(find_ros2_profile("limmo"));
  const auto nameless = find_ros2_profile("");
  ASSERT_FALSE(nameless);
  EXPECT_NE(to_string(nameless.error()).find("no profile is named"), std::string::npos);
}

TEST(Ros2Profile, ItsInterfaceIsUsedWhereNothingElseRestricts) {
  BusOptions options;
  ASSERT_TRUE(use_interface_of({.interface = "lo"}, options));
  EXPECT_EQ(options.interfaces, (std::vector<std::string>{"127.0.0.1"}));
  BusOptions local{.localhost_only = true};
  EXPECT_TRUE(use_interface_of({.interface = "203.0.113.9"}, local)) << "not used";
  BusOptions all;
  EXPECT_FALSE(use_interface_of({.interface = "203.0.113.9"}, all));
}

TEST(Ros2Profile, NamesWhatADriveNeedsAndNobodyPublishes) {
  const auto published = [](const char* topic, std::string_view type) {
    return BusEndpoint{.publishes = true, .name = dds_topic(topic, type)};
  };
  const Ros2Profile pictures{.image_topic = "/image"};
  EXPECT_THAT(missing_publishers(pictures, {}), ::testing::ElementsAre(::testing::HasSubstr("/image")));
  EXPECT_TRUE(missing_publishers(pictures, {published("/image", ros2::Image::kType)}).empty());
  EXPECT_TRUE(
      missing_publishers(pictures, {published("/image/compressed", ros2::CompressedImage::kType)}).empty());
  BusEndpoint wanted = published("/image", ros2::Image::kType);
  wanted.publishes = false;
  EXPECT_EQ(missing_publishers(pictures, {wanted}).size(), 1U) << "somebody asks for it";
  const Ros2Profile simulated{.use_sim_time = true};
  EXPECT_THAT(missing_publishers(simulated, {}), ::testing::ElementsAre(::testing::HasSubstr("/clock")));
  EXPECT_TRUE(missing_publishers(simulated, {published("/clock", "rosgraph_msgs/msg/Clock")}).empty());
}

TEST(Ros2Profile, SensorsAreBestEffortAndTfStaticIsKept) {
  Ros2Profile profile;
  profile.image_topic = "/image";
  for (const Ros2Subscription& one : subscriptions_of(profile)) {  // /tf changes: nobody waits for it
    const bool fixed = one.topic == "/tf_static";
    EXPECT_EQ(one.qos.reliable, fixed) << one.topic;
    EXPECT_EQ(one.qos.transient_local, fixed) << one.topic;
  }
}

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

TEST(MessageText, RefusesWhatItCannotRead) {
  const auto bytes = cdr::encode(ros2::to_ros(Odometry{}));
  EXPECT_FALSE(message_text("my_msgs/msg/Own", bytes));
  EXPECT_FALSE(message_text(ros2::Odometry::kType, std::span(bytes).first(40)));
  EXPECT_FALSE(message_text(ros2::Odometry::kType, {}));
  std::vector<std::uint8_t> names = {0, 1, 0, 0};
  names.resize(200, 0xff);  // a list of 4 thousand million transforms
  EXPECT_FALSE(message_text(ros2::TFMessage::kType, names));
  EXPECT_FALSE(message_text(ros2::Joy::kType, names));
}

/// A network on which one program was discovered.
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
  std::vector<std::string> advertised{};  ///< types
  std::vector<std::vector<std::uint8_t>> sent{};
};

TEST(LogPublisher, CommandsGoOutAsTheTypeThatIsSubscribed) {
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
  const auto words = publisher.take_words();
  ASSERT_EQ(words.size(), 1U);
  EXPECT_NE(words[0].find("/cmd_vel is subscribed as geometry_msgs/msg/Twist"), std::string::npos);
  ASSERT_TRUE(publisher.stop());
  EXPECT_TRUE(cdr::decode<ros2::Twist>(bus.sent.back())) << "zero, of the same type";
  const LogChannel other{
      .topic = "/other", .type = std::string(ros2::TwistStamped::kType), .encoding = "cdr"};
  ASSERT_TRUE(publisher.publish(other, {.data = stamped}));
  EXPECT_EQ(bus.advertised.back(), "geometry_msgs::msg::dds_::TwistStamped_")
      << "as recorded: nobody listens";
  const LogChannel odometry{.topic = "/odom", .type = std::string(ros2::Odometry::kType), .encoding = "cdr"};
  const Status alone = nobody_publishes({recorded, odometry}, false, bus);
  ASSERT_FALSE(alone);
  EXPECT_NE(to_string(alone.error()).find("another program publishes /odom; nodes there: teleop"),
            std::string::npos);
  EXPECT_TRUE(nobody_publishes({recorded}, false, bus)) << "commands are left out";
  EXPECT_FALSE(nobody_publishes({recorded}, true, bus));
}

TEST(LogPublisher, KeepsForLateJoinersWhatWasOfferedSo) {
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

TEST(Relay, SaysWhatKeepsCommandsFromTheRobot) {
  const auto topic = [](const char* name, const char* type) { return dds_topic(name, type); };
  const TopicUse from{.name = topic("/teleop", "geometry_msgs/msg/Twist"), .qos = {.reliable = false}};
  const TopicUse to{.publishes = true, .name = topic("/cmd_vel", "geometry_msgs/msg/Twist")};
  const BusEndpoint driver{true, from.name, {}, Guid{1}};
  const BusEndpoint robot{false, to.name, {}, Guid{2}};
  EXPECT_TRUE(relay_problems(from, to, {driver, robot}).empty());
  const auto nobody = relay_problems(from, to, {});
  ASSERT_EQ(nobody.size(), 2U);
  EXPECT_NE(nobody[0].find("nobody publishes /teleop yet"), std::string::npos);
  EXPECT_NE(nobody[1].find("nobody subscribes to /cmd_vel yet"), std::string::npos);
  const BusEndpoint stamped{true, topic("/teleop", "geometry_msgs/msg/TwistStamped"), {}, Guid{3}};
  const auto other_type = relay_problems(from, to, {stamped, robot});
  ASSERT_EQ(other_type.size(), 1U);
  EXPECT_NE(other_type[0].find("/teleop is published as geometry_msgs/msg/TwistStamped"), std::string::npos);
  const BusEndpoint past{true, to.name, {}, Guid{4}};
  const auto beside = relay_problems(from, to, {driver, robot, past});
  ASSERT_EQ(beside.size(), 1U);
  EXPECT_NE(beside[0].find("another program publishes /cmd_vel too"), std::string::npos);
}

TEST(PublisherNames, AreThoseOfNodesWhereNodesSayWhatTheyHave) {
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
  bus.program = "/";  // what programs of ROS call themselves: their enclave
  EXPECT_EQ(none.of({Guid{1}}, bus), "");
}

TEST(TopicTools, ListWhoUsesATopic) {
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

TEST(TopicTools, RateIsThatOfTheMessages) {
  RateCounter counter;
  EXPECT_EQ(counter.text(), "no message");
  for (int i = 0; i <= 100; ++i) counter.add(milliseconds(20 * i), 1000);
  EXPECT_DOUBLE_EQ(counter.rate_hz(), 50);
  EXPECT_EQ(counter.text(), "50.00 Hz, 0.050 MB/s, 20.0 ms apart (from 20.0 to 20.0), 101 messages");
}

}  // namespace
}  // namespace waymark

#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// Names as ROS 2 maps them to DDS (design.ros2.org, "Topic and Service name mapping to DDS"): the topic
/// "/odom" of type "nav_msgs/msg/Odometry" is "rt/odom" of type "nav_msgs::msg::dds_::Odometry_".
[[nodiscard]] BusTopic dds_topic(std::string_view ros_topic, std::string_view ros_type);
/// Back; nothing where it is no topic of ROS (services, ros_discovery_info, other programs).
struct RosTopic {
  std::string topic{};
  std::string type{};
};
[[nodiscard]] std::optional<RosTopic> ros_topic(const BusTopic& dds);

/// Whether ROS 2 takes it as the name of a topic: parts of letters, digits and underscores that begin with no
/// digit, with slashes between them.
[[nodiscard]] bool is_topic_name(std::string_view name);

/// The two topics of a service "/start" of type "std_srvs/srv/Trigger".
struct ServiceTopics {
  BusTopic request{};
  BusTopic reply{};
};
[[nodiscard]] ServiceTopics dds_service(std::string_view ros_service, std::string_view ros_type);

}  // namespace waymark

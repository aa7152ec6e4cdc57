#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// Maps a ROS 2 topic to DDS names (design.ros2.org, "Topic and Service name mapping to DDS"): "/odom" of
/// type "nav_msgs/msg/Odometry" becomes "rt/odom" of type "nav_msgs::msg::dds_::Odometry_".
[[nodiscard]] BusTopic dds_topic(std::string_view ros_topic, std::string_view ros_type);
/// The inverse of dds_topic(); `nullopt` if it is not a ROS topic (services, ros_discovery_info, other
/// programs).
struct RosTopic {
  std::string topic{};
  std::string type{};
};
[[nodiscard]] std::optional<RosTopic> ros_topic(const BusTopic& dds);

/// Whether ROS 2 accepts the topic name: parts separated by slashes, made of letters, digits and underscores,
/// that do not begin with a digit.
[[nodiscard]] bool is_topic_name(std::string_view name);

/// The two topics of a service such as "/start" of type "std_srvs/srv/Trigger".
struct ServiceTopics {
  BusTopic request{};
  BusTopic reply{};
};
[[nodiscard]] ServiceTopics dds_service(std::string_view ros_service, std::string_view ros_type);

}  // namespace waymark

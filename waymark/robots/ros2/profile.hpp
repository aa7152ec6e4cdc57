#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/robots/dds/discovery.hpp"

namespace waymark {

/// Topics and conventions of a robot with ROS 2 (docs/formats/ros2-profile.md). Empty topics are not used.
struct Ros2Profile {
  std::string robot = "limo";
  std::string command_topic = "/cmd_vel";
  bool command_stamped = false;
  bool stops_by_itself = false;
  std::string odometry_topic = "/odom";
  std::string imu_topic{};
  std::string wheels_topic{};
  std::string scan_topic{};
  std::string image_topic{};
  std::string compressed_image_topic{};
  std::string camera_info_topic{};
  std::string detections_topic{};
  std::string gamepad_topic{};
  std::string truth_topic{};
  std::string base_frame{};
  std::string odom_frame{};
  bool reliable_sensors = false;
  std::string interface {};
  std::string ros_distro{};
  bool use_sim_time = false;
  bool simulated = false;
  std::string text{};    ///< the text from which it was read; not a field
  std::string source{};  ///< the file that contains the text

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.robot, Field{"robot", "Name or path of the robot file, with body and camera (robot.md)."});
    visit(self.command_topic, Field{"command_topic", "Topic of the velocity commands."});
    visit(self.command_stamped, Field{"command_stamped", "Commands are TwistStamped instead of Twist."});
    visit(self.stops_by_itself,
          Field{"stops_by_itself", "The robot stops by itself if commands cease for half a second or less."});
    visit(self.odometry_topic, Field{"odometry_topic", "nav_msgs/msg/Odometry; required."});
    visit(self.imu_topic, Field{"imu_topic", "sensor_msgs/msg/Imu."});
    visit(self.wheels_topic,
          Field{"wheels_topic", "sensor_msgs/msg/JointState with a left and a right wheel."});
    visit(self.scan_topic, Field{"scan_topic", "sensor_msgs/msg/LaserScan."});
    visit(self.image_topic, Field{"image_topic", "sensor_msgs/msg/Image."});
    visit(self.compressed_image_topic,
          Field{"compressed_image_topic", "sensor_msgs/msg/CompressedImage, instead of image_topic."});
    visit(self.camera_info_topic,
          Field{"camera_info_topic",
                "sensor_msgs/msg/CameraInfo, compared with the camera of the robot file."});
    visit(self.detections_topic,
          Field{"detections_topic",
                "apriltag_msgs/msg/AprilTagDetectionArray of the robot's own detector, instead of "
                "images."});
    visit(self.gamepad_topic, Field{"gamepad_topic", "sensor_msgs/msg/Joy; recorded."});
    visit(self.truth_topic,
          Field{"truth_topic",
                "Ground truth of a simulator, geometry_msgs/msg/PoseStamped; only for evaluation."});
    visit(self.base_frame,
          Field{"base_frame",
                "Frame of the robot's base in tf; empty: child_frame_id of the odometry, or base_link."});
    visit(self.odom_frame,
          Field{"odom_frame", "Frame of the odometry in tf; empty: frame_id of its messages, or odom."});
    visit(self.reliable_sensors,
          Field{"reliable_sensors",
                "Request reliable images, scans, odometry and IMU data instead of best effort."});
    visit(self.interface,
          Field{"interface",
                "IPv4 address or name of the network interface, unless ROS's environment restricts it; "
                "empty: all."});
    visit(self.ros_distro,
          Field{"ros_distro",
                "ROS 2 release whose node list shows this program: humble, jazzy, ...; empty: none."});
    visit(
        self.use_sim_time,
        Field{"use_sim_time",
              "Use the time of /clock (rosgraph_msgs/msg/Clock), like the ROS parameter of this name: for a "
              "simulation that is slower or faster than real time, or paused."});
    visit(self.simulated,
          Field{"simulated", "The robot is simulated and needs no first drive (`waymark commission`)."});
  }
};

/// Parses a profile from YAML. Errors contain file, line and key. It is also an error if the topic for
/// odometry or commands is missing or there is more than one source of tags.
[[nodiscard]] Result<Ros2Profile> parse_ros2_profile(std::string_view text, const std::string& source);
/// Reads the profile with a plain name from share/ros2, or otherwise from a path.
[[nodiscard]] Result<Ros2Profile> find_ros2_profile(const std::string& name);

/// Restricts the options to the profile's interface, unless the ROS environment or the user's RosPlace
/// already restricts them. Fails if this computer does not have that interface.
[[nodiscard]] Status use_interface_of(const Ros2Profile& profile, BusOptions& options);

/// Options for joining the network of the profile's robot, from the ROS environment and the profile's
/// interface. Fails if a value in either is invalid.
[[nodiscard]] Result<BusOptions> network_of(const Ros2Profile& profile, const std::string& node);

/// The time of a simulation.
struct ClockMessage {
  static constexpr std::string_view kType = "rosgraph_msgs/msg/Clock";
  ros2::Time clock{};
  WAYMARK_ROS2_FIELDS(self.clock)
};

/// Topic, message type and quality of service for a subscription in the profile.
struct Ros2Subscription {
  std::string topic{};
  std::string type{};
  TopicQos qos{};
};
[[nodiscard]] std::vector<Ros2Subscription> subscriptions_of(const Ros2Profile& profile);
/// Topic, type and quality of service for the commands; reliable, as nodes expect.
[[nodiscard]] TopicUse command_use(const Ros2Profile& profile);
/// All topics in the profile with their DDS names.
[[nodiscard]] std::vector<TopicUse> uses_of(const Ros2Profile& profile);

/// Whether one of the endpoints publishes a topic, with this type unless `type` is empty.
[[nodiscard]] bool is_published(const std::string& topic, const std::vector<BusEndpoint>& others,
                                std::string_view type = {});
/// One message for each required topic that has no publisher: images, tags, and the clock.
[[nodiscard]] std::vector<std::string> missing_publishers(const Ros2Profile& profile,
                                                          const std::vector<BusEndpoint>& others);

}  // namespace waymark

#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/fields.hpp"

namespace waymark {

/// Topics of a robot in Gazebo (docs/howto/gazebo.md). Empty topics are not used.
struct GazeboProfile {
  std::string robot = "limo-gazebo";
  std::string command_topic = "/model/limo/cmd_vel";
  std::string odometry_topic = "/model/limo/odometry";
  std::string imu_topic{};
  std::string scan_topic{};
  std::string image_topic{};
  std::string camera_info_topic{};
  std::string gamepad_topic{};
  std::string truth_topic{};
  std::string truth_model{};
  std::string clock_topic{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.robot, Field{"robot", "Name or path of the robot file, with body and camera (robot.md)."});
    visit(self.command_topic,
          Field{"command_topic", "Topic of the velocity commands, ignition.msgs.Twist; required."});
    visit(self.odometry_topic, Field{"odometry_topic", "ignition.msgs.Odometry; required."});
    visit(self.imu_topic, Field{"imu_topic", "ignition.msgs.IMU."});
    visit(self.scan_topic, Field{"scan_topic", "ignition.msgs.LaserScan."});
    visit(self.image_topic, Field{"image_topic", "ignition.msgs.Image."});
    visit(
        self.camera_info_topic,
        Field{"camera_info_topic", "ignition.msgs.CameraInfo, compared with the camera of the robot file."});
    visit(self.gamepad_topic, Field{"gamepad_topic", "ignition.msgs.Joy; recorded."});
    visit(self.truth_topic,
          Field{"truth_topic",
                "Ground truth of the simulator, ignition.msgs.Pose or Pose_V; only for evaluation."});
    visit(self.truth_model,
          Field{"truth_model", "Name of the model whose pose on truth_topic is used; empty: the first."});
    visit(
        self.clock_topic,
        Field{"clock_topic", "ignition.msgs.Clock: distinguishes a paused simulation from one that ended."});
  }
};

/// Parses a profile from YAML. Errors contain file, line and key. It is also an error if the topic for
/// odometry or commands is missing or a topic is used twice.
[[nodiscard]] Result<GazeboProfile> parse_gazebo_profile(std::string_view text, const std::string& source);
/// Reads the profile with a plain name from share/gazebo, or otherwise from a path.
[[nodiscard]] Result<GazeboProfile> find_gazebo_profile(const std::string& name);

/// The kind of messages on a subscribed topic.
enum class GazeboKind : std::uint8_t { Odometry, Imu, Scan, Image, CameraInfo, Gamepad, Truth, Clock };

/// A topic to subscribe to.
struct GazeboSubscription {
  GazeboKind kind = GazeboKind::Odometry;
  std::string topic{};
  std::string type{};  ///< expected message type
  int depth = 100;     ///< maximum number of queued messages
};
[[nodiscard]] std::vector<GazeboSubscription> subscriptions_of(const GazeboProfile& profile);

}  // namespace waymark

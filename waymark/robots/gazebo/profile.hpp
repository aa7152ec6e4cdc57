#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/fields.hpp"

namespace waymark {

/// How a robot in Gazebo speaks (docs/howto/gazebo.md). An empty topic is not used.
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
    visit(self.robot, Field{"robot", "Name or path of the file of its body and camera (robot.md)."});
    visit(self.command_topic,
          Field{"command_topic", "Topic of the velocity commands, ignition.msgs.Twist; needed."});
    visit(self.odometry_topic, Field{"odometry_topic", "ignition.msgs.Odometry; needed."});
    visit(self.imu_topic, Field{"imu_topic", "ignition.msgs.IMU."});
    visit(self.scan_topic, Field{"scan_topic", "ignition.msgs.LaserScan."});
    visit(self.image_topic, Field{"image_topic", "ignition.msgs.Image."});
    visit(
        self.camera_info_topic,
        Field{"camera_info_topic", "ignition.msgs.CameraInfo, held against the camera of the robot's file."});
    visit(self.gamepad_topic, Field{"gamepad_topic", "ignition.msgs.Joy; recorded."});
    visit(self.truth_topic,
          Field{"truth_topic", "ignition.msgs.Pose or Pose_V of the simulator; only for judges."});
    visit(self.truth_model,
          Field{"truth_model", "Name of the model whose pose counts on truth_topic; empty: the first."});
    visit(
        self.clock_topic,
        Field{"clock_topic", "ignition.msgs.Clock: tells a simulation that is paused from one that ended."});
  }
};

/// A profile from YAML. Errors have file, line and key; also where odometry or commands have no topic, and
/// where two keys name one topic.
[[nodiscard]] Result<GazeboProfile> parse_gazebo_profile(std::string_view text, const std::string& source);
/// Of a plain name the file in share/gazebo, else of a path.
[[nodiscard]] Result<GazeboProfile> find_gazebo_profile(const std::string& name);

/// What a subscribed topic carries.
enum class GazeboKind : std::uint8_t { Odometry, Imu, Scan, Image, CameraInfo, Gamepad, Truth, Clock };

/// A topic that is subscribed.
struct GazeboSubscription {
  GazeboKind kind = GazeboKind::Odometry;
  std::string topic{};
  std::string type{};  ///< what is expected there
  int depth = 100;     ///< messages that may wait
};
[[nodiscard]] std::vector<GazeboSubscription> subscriptions_of(const GazeboProfile& profile);

}  // namespace waymark

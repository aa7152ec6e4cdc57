#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/recording/ros2/frame_tree.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/ros2/profile.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {

/// A robot as a node for others needs to know it.
struct NodeRobot {
  std::optional<Ros2Profile> profile{};  ///< of a robot that speaks ROS 2 itself
  std::vector<MountedCamera> cameras{};
  bool own_pictures = true;  ///< the camera "cam" is the one of the profile's topics
};

/// The names of a robot's frames, as it has them itself: those of its odometry, and of its camera's messages.
/// Of what is not said there the names are odom, base_link and camera_optical. Listens to the topics of the
/// profile until they said it; one thread.
class RobotFrames {
 public:
  explicit RobotFrames(NodeRobot robot);

  Status join(Bus& bus);
  /// Whether the message was for it, and is dealt with.
  bool take(Bus& bus, const BusMessage& message);
  /// The robot is there: from now on what it does not say within three seconds counts as not said.
  void robot_speaks(Duration now);
  /// Nothing is waited for any more.
  [[nodiscard]] bool settled(Duration now) const;

  [[nodiscard]] std::string odom() const;
  [[nodiscard]] std::string base() const;
  [[nodiscard]] std::string camera(std::string_view name) const;
  /// All mountings that this program has to publish, since this camera is seen, too, and no transform on the
  /// network joins its frame to the base; nothing where they are those of the call before.
  [[nodiscard]] std::optional<ros2::TFMessage> mount(Bus& bus, const std::string& camera, Duration now);

 private:
  Status listen(Bus& bus, const std::string& topic, std::string_view type, const TopicQos& qos,
                std::optional<std::size_t>& number);
  void hear_odometry(const BusMessage& message);
  void hear_camera(const BusMessage& message);
  void hear_transforms(const BusMessage& message);
  static void end(Bus& bus, std::optional<std::size_t>& number);

  NodeRobot robot_;
  std::string odom_{};
  std::string base_{};
  std::string camera_{};
  std::optional<std::size_t> odometry_{};  ///< subscriptions, while something is to be learned there
  std::optional<std::size_t> pictures_{};
  std::optional<std::size_t> fixed_{};
  std::optional<std::size_t> moving_{};
  FrameTree tree_{};
  std::optional<Duration> since_{};
  std::set<std::string> looked_at_{};  ///< cameras
  ros2::TFMessage mountings_{};
};

}  // namespace waymark

// Any bytes as a message of a robot that speaks ROS 2: lines that the other side of the wire reads, or a
// counted drop, never a crash. The first byte chooses the subscription, the second when it comes.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "waymark/config/share.hpp"
#include "waymark/robots/ros2/initial_pose.hpp"
#include "waymark/robots/ros2/robot_bridge.hpp"
#include "waymark/robots/ros2/topic_tools.hpp"

namespace {

using namespace waymark;

RobotDescription limo() {
  const auto path = find_shared("robots", "limo");
  auto robot = path ? read_robot(*path) : tl::unexpected(path.error());
  if (!robot) std::abort();
  return *robot;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const RobotDescription kRobot = limo();
  static const Ros2Profile kProfile = [] {
    Ros2Profile profile;
    profile.imu_topic = "/imu";
    profile.wheels_topic = "/joint_states";
    profile.scan_topic = "/scan";
    profile.image_topic = "/image";
    profile.camera_info_topic = "/camera_info";
    profile.gamepad_topic = "/joy";
    profile.truth_topic = "/truth/pose";
    profile.compressed_image_topic = "/image/compressed";
    return profile;
  }();
  static const std::vector<Ros2Subscription> kAll = subscriptions_of(kProfile);
  RobotBridge bridge(kProfile, kRobot);
  RobotMessageReader other_side("fuzz");
  (void)other_side.read({.number = 1, .text = to_line(RobotHello{.name = "fuzz"})});
  // Several messages in one input, so that transforms, odometry and pictures meet: each behind three bytes.
  while (size > 3) {
    const Ros2Subscription& from = kAll[data[0] % kAll.size()];
    const Duration arrived = std::chrono::milliseconds(data[1]);
    const std::size_t length = std::min<std::size_t>(size - 3, std::size_t{data[2]} * 16);
    const std::span<const std::uint8_t> message(data + 3, length);
    for (const std::string& line : bridge.receive(from, message, arrived))
      if (!other_side.read({.number = 2, .text = line})) std::abort();
    (void)bridge.take_reports();
    (void)message_text(from.type, message);
    if (const auto pose = read_initial_pose(message); pose && !pose->map_T_base.matrix().allFinite())
      std::abort();
    data += 3 + length;
    size -= 3 + length;
  }
  return 0;
}

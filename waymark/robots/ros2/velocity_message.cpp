#include "waymark/robots/ros2/velocity_message.hpp"

#include <chrono>
#include <thread>

#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"

namespace waymark {

std::vector<std::uint8_t> velocity_message(const StampedCommand& command, bool stamped) {
  const ros2::TwistStamped message = ros2::to_ros(command);
  return stamped ? cdr::encode(message) : cdr::encode(message.twist);
}

std::vector<std::uint8_t> velocity_message_now(const VelocityCommand& command, bool stamped) {
  const auto now = std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch());
  return velocity_message({SensorTime(now), command}, stamped);
}

Status publish_zero(Bus& bus, std::size_t publisher, bool stamped) {
  constexpr int kTimes = 4;
  constexpr auto kApart = std::chrono::milliseconds(20);
  for (int i = 0; i < kTimes; ++i) {
    if (Status status = bus.publish(publisher, velocity_message_now({}, stamped)); !status) return status;
    std::this_thread::sleep_for(kApart);
  }
  return {};
}

}  // namespace waymark

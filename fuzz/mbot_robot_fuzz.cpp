// Any bytes as messages of an MBot: lines that the other side of the wire reads, or a counted drop, never a
// crash. Each message stands behind three bytes: channel and type, when it comes, and how long it is.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "waymark/robots/mbot/mbot_bridge.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace waymark;
  struct Stream {
    const char* channel;
    std::uint64_t type;
  };
  static constexpr std::array kStreams = {Stream{"MBOT_ODOMETRY", mbot::kPose2D},
                                          Stream{"MBOT_VEL", mbot::kTwist2D},
                                          Stream{"MBOT_IMU", mbot::kImu},
                                          Stream{"MBOT_ENCODERS", mbot::kEncoders},
                                          Stream{"LIDAR", mbot::kLidar},
                                          Stream{"MBOT_APRILTAG_ARRAY", mbot::kTagArray},
                                          Stream{"MBOT_TIMESYNC", mbot::kTimestamp}};
  MbotBridge bridge;
  RobotMessageReader other_side("fuzz");
  (void)other_side.read({.number = 1, .text = to_line(RobotHello{.name = "fuzz"})});
  Duration now{};
  while (size > 3) {
    const Stream& from = kStreams[data[0] % kStreams.size()];
    const std::size_t length = std::min<std::size_t>(size - 3, std::size_t{data[2]} * 8);
    now += std::chrono::milliseconds(data[1]);
    LcmMessage message{.channel = from.channel, .arrived = now, .received_us = now.count() / 1000};
    if (data[0] < 240)  // the others begin with any fingerprint
      for (int shift = 56; shift >= 0; shift -= 8)
        message.payload.push_back(static_cast<std::uint8_t>(from.type >> shift));
    message.payload.insert(message.payload.end(), data + 3, data + 3 + length);
    for (const std::string& line : bridge.receive(std::move(message)))
      if (!other_side.read({.number = 2, .text = line})) std::abort();
    (void)bridge.take_reports();
    data += 3 + length;
    size -= 3 + length;
  }
  return 0;
}

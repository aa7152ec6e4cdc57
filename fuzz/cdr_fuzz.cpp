// Any bytes as a ROS 2 message of any supported type: a sample or an error with a message, never a crash. The
// first byte selects the type.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/recording/ros2/sample_decoder.hpp"

namespace {

using namespace waymark;

void demand(bool holds) {
  if (!holds) std::abort();
}

constexpr std::array kTypes = {ros2::AprilTagDetectionArray::kType,
                               ros2::TagCornerCovariances::kType,
                               ros2::Odometry::kType,
                               ros2::JointState::kType,
                               ros2::Imu::kType,
                               ros2::TwistStamped::kType,
                               ros2::Twist::kType,
                               ros2::PoseStamped::kType,
                               ros2::Image::kType,
                               ros2::CompressedImage::kType,
                               ros2::LaserScan::kType,
                               ros2::Joy::kType,
                               ros2::RangeBearing::kType,
                               ros2::TagPoseArray::kType,
                               ros2::CameraInfo::kType,
                               ros2::TFMessage::kType,
                               ros2::UnreliableTags::kType};

/// A decoded message encodes to bytes that decode to the same message.
template <class Message>
void through(ByteSpan cdr) {
  const auto message = cdr::decode<Message>(cdr);
  if (!message) return;
  const Bytes once = cdr::encode(*message);
  const auto again = cdr::decode<Message>(once);
  demand(again.has_value());
  demand(cdr::encode(*again) == once);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view type = kTypes[data[0] % kTypes.size()];
  const ByteSpan cdr(data + 1, size - 1);
  SampleDecoder decoder([](const Sample&) { return Status{}; });
  for (const char* topic : {"/x", "/truth/pose"}) {
    const Status status = decoder.add(topic, type, 1, cdr);
    demand(status || !status.error().message.empty());
  }
  demand(decoder.finish().has_value());
  RecordingSetup setup;
  (void)add_fact(setup.facts, "/x", type, cdr);
  choose(setup);
  through<ros2::AprilTagDetectionArray>(cdr);
  through<ros2::UnreliableTags>(cdr);
  through<ros2::MarkerArray>(cdr);
  through<ros2::DiagnosticArray>(cdr);
  through<ros2::Path>(cdr);
  return 0;
}

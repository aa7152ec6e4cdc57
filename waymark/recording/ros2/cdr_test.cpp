#include "waymark/recording/ros2/cdr.hpp"

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/recording/ros2/messages.hpp"

namespace waymark::ros2 {
namespace {

// Expected bytes, written by hand from the wire protocol: the encapsulation, then each number aligned to its
// own size.
TEST(Cdr, MatchesTheWireProtocol) {
  PoseStamped message;
  message.header.stamp = {1, 2};
  message.header.frame_id = "map";
  message.pose.position.x = 1.0;
  const Bytes bytes = cdr::encode(message);
  const Bytes begin = {0, 1, 0, 0,                         // plain CDR, little-endian
                       1, 0, 0, 0, 2,   0,   0,    0,      // stamp
                       4, 0, 0, 0, 'm', 'a', 'p',  0,      // length including the terminating zero, text
                       0, 0, 0, 0, 0,   0,   0xf0, 0x3f};  // 1.0, aligned to 8 after the encapsulation
  ASSERT_EQ(bytes.size(), 4 + 16 + 7 * 8U);
  EXPECT_EQ(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(begin.size())), begin);
}

TEST(Cdr, PaddingDependsOnThePrecedingString) {
  for (const std::string frame : {"", "a", "ab", "abc", "abcd", "base_link"}) {
    PoseStamped message;
    message.header.frame_id = frame;
    message.pose.orientation.w = 0.5;
    const auto back = cdr::decode<PoseStamped>(cdr::encode(message));
    ASSERT_TRUE(back) << frame;
    EXPECT_EQ(back->header.frame_id, frame);
    EXPECT_EQ(back->pose.orientation.w, 0.5);
  }
}

AprilTagDetectionArray some_detections() {
  AprilTagDetectionArray message;
  message.header.frame_id = "camera_optical";
  for (int i = 0; i < 3; ++i) {
    AprilTagDetection detection;
    detection.family = "tag36h11";
    detection.id = i;
    detection.corners[3] = {1.5 * i, -2.0};
    message.detections.push_back(detection);
  }
  return message;
}

TEST(Cdr, NestedSequencesRoundTrip) {
  const auto back = cdr::decode<AprilTagDetectionArray>(cdr::encode(some_detections()));
  ASSERT_TRUE(back);
  ASSERT_EQ(back->detections.size(), 3U);
  EXPECT_EQ(back->detections[2].id, 2);
  EXPECT_EQ(back->detections[2].corners[3].x, 3.0);
}

TEST(Cdr, EveryTruncationFailsAndDamageDoesNotCrash) {
  const Bytes whole = cdr::encode(some_detections());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(cdr::decode<AprilTagDetectionArray>(ByteSpan(whole).first(size))) << size;
  }
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    Bytes damaged = whole;
    damaged[4 + random.index(damaged.size() - 4)] = static_cast<std::uint8_t>(random.index(256));
    const auto back = cdr::decode<AprilTagDetectionArray>(damaged);
    if (back) {
      EXPECT_LE(back->detections.size(), damaged.size());
    }
  }
}

TEST(Cdr, RejectsBigEndian) {
  Bytes bytes = cdr::encode(Twist{});
  bytes[1] = 0;
  const auto twist = cdr::decode<Twist>(bytes);
  ASSERT_FALSE(twist);
  EXPECT_EQ(twist.error().code, ErrorCode::Unsupported);
}

}  // namespace
}  // namespace waymark::ros2

#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/recording/lcm/mbot_messages.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark::mbot {

/// Conventions of an MBot's tags and accelerometer. They differ between publishers and are not stored in the
/// messages, so they are determined in a first pass over the log.
struct Conventions {
  bool millimetres = false;                  ///< otherwise in metres
  bool quaternion_w_first = false;           ///< otherwise x, y, z, w
  bool angles_in_degrees = false;            ///< for angles_rpy, used only to determine the quaternion order
  bool tag_y_up = false;                     ///< y up, z towards the reader; otherwise y down, z into the tag
  bool accelerometer_shows_gravity = false;  ///< shows the negative of specific force
};

/// Determines the conventions from all messages in a log. O(1) memory.
class Survey {
 public:
  void add(ByteSpan payload);
  [[nodiscard]] Conventions conventions() const;
  /// The number of messages that contribute to the result.
  [[nodiscard]] std::uint64_t tags() const { return tags_; }
  [[nodiscard]] std::uint64_t imus() const { return imus_; }

 private:
  void add(const TagArray& array);

  std::array<double, 4> misfit_{};  ///< between quaternion and angles_rpy: {xyzw, wxyz} x {rad, deg}
  std::uint64_t tags_ = 0;
  std::uint64_t far_tags_ = 0;  ///< tags that would be beyond the range of detection if read as metres
  std::array<std::uint64_t, 2>
      turned_away_{};  ///< number of tags with z towards the camera, for either quaternion order
  double accel_z_sum_ = 0;
  std::uint64_t imus_ = 0;
};

/// Converts an MBot's messages to samples in Waymark's conventions and notes each correction.
class Samples {
 public:
  Samples(const Conventions& conventions, Duration camera_latency, LogProblems& problems,
          const MessageLog::SampleVisitor& visit)
      : conventions_(conventions), camera_latency_(camera_latency), problems_(problems), visit_(visit) {}

  /// Adds a message received at `receive_us`.
  Status add(std::string_view channel, std::int64_t receive_us, ByteSpan payload);
  /// Visits samples that are still waiting for another message.
  Status finish();
  /// Sets the conventions for later messages, for callers that determine them while messages arrive.
  void use(const Conventions& conventions) { conventions_ = conventions; }

 private:
  Status on_pose(std::string_view channel, std::int64_t receive_us, ByteSpan payload);
  Status on_twist(std::string_view channel, std::int64_t receive_us, ByteSpan payload);
  Status on_encoders(std::string_view channel, std::int64_t receive_us, ByteSpan payload);
  Status on_imu(std::string_view channel, std::int64_t receive_us, ByteSpan payload);
  Status on_tags(std::string_view channel, std::int64_t receive_us, ByteSpan payload);
  Status on_lidar(std::string_view channel, std::int64_t receive_us, ByteSpan payload);
  void note_tag_traps(const TagArray& array);
  void note_nested_tags(const TagArray& array);
  std::optional<SeenTagPose> seen(const Tag& tag);
  static SensorTime stamp(std::int64_t utime, std::int64_t receive_us);
  Status undecodable(std::string_view channel);

  Conventions conventions_;
  Duration camera_latency_;
  LogProblems& problems_;
  const MessageLog::SampleVisitor& visit_;
  std::optional<Odometry> odometry_{};  ///< waits for the twist with the same stamp
};

}  // namespace waymark::mbot

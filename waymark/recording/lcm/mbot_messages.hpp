#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "waymark/recording/byte_io.hpp"

/// LCM messages of the MBot (mbot_lcm_base, package mbot_lcm_msgs). Each consists of an 8-byte fingerprint of
/// its type, followed by the members in order, big-endian. Units and frames are those of the robot;
/// mbot_samples.hpp converts them.
namespace waymark::mbot {

inline constexpr std::uint64_t kPose2D = 0x1f317af1246276ac;
inline constexpr std::uint64_t kTwist2D = 0x85d72aee83523195;
inline constexpr std::uint64_t kEncoders = 0xaefa0bcd9e362081;
inline constexpr std::uint64_t kImu = 0x9ef39a5ffc75e462;
inline constexpr std::uint64_t kTagArray = 0x815931ba2e0b44c2;
inline constexpr std::uint64_t kLidar = 0x89dc5b879a5056cf;
inline constexpr std::uint64_t kTimestamp = 0x4d0d41c1f105b12f;

/// The name of the type with a given fingerprint ("pose2D_t"); empty for other types.
[[nodiscard]] std::string_view type_name(std::uint64_t fingerprint);
/// The first 8 bytes of a payload; 0 if it is shorter.
[[nodiscard]] std::uint64_t fingerprint_of(ByteSpan payload);

/// The stamp [us] of a message whose type begins with one.
[[nodiscard]] std::optional<std::int64_t> utime_of(ByteSpan payload);

struct Pose2D {
  std::int64_t utime = 0;  ///< [us]
  float x = 0, y = 0, theta = 0;
};
struct Twist2D {
  std::int64_t utime = 0;
  float vx = 0, vy = 0, wz = 0;
};
struct Encoders {
  std::int64_t utime = 0;
  std::array<std::int64_t, 3> ticks{};  ///< left wheel, right wheel (counting backwards), unused
  std::array<std::int32_t, 3> delta_ticks{};
  std::int32_t delta_time = 0;  ///< [us]
};
struct Imu {
  std::int64_t utime = 0;
  std::array<float, 3> gyro{};   ///< [rad/s]
  std::array<float, 3> accel{};  ///< [m/s^2]
  std::array<float, 3> mag{};
  std::array<float, 3> angles_rpy{};  ///< [rad]
  std::array<float, 4> angles_quat{};
  float temp = 0;
};
struct Tag {
  std::int32_t id = 0;
  std::int64_t utime = 0;
  std::array<float, 3> position{};
  std::array<float, 3> angles_rpy{};
  std::array<float, 4> angles_quat{};
};
struct TagArray {
  std::int64_t utime = 0;
  std::vector<Tag> tags{};
};
struct Lidar {
  std::int64_t utime = 0;
  std::vector<float> ranges{};        ///< [m]
  std::vector<float> thetas{};        ///< [rad]
  std::vector<std::int64_t> times{};  ///< [us]
  std::vector<float> intensities{};
};

/// Sent by the robot's computer once per second as the time base of its control board (MBOT_TIMESYNC).
struct Timestamp {
  std::int64_t utime = 0;
};

/// Decodes a payload including its fingerprint. Empty unless the bytes are exactly one such message.
template <class Message>
[[nodiscard]] std::optional<Message> decode(ByteSpan payload);

/// Encodes a message as a payload.
[[nodiscard]] Bytes encode(const Pose2D& message);
[[nodiscard]] Bytes encode(const Twist2D& message);
[[nodiscard]] Bytes encode(const Encoders& message);
[[nodiscard]] Bytes encode(const Imu& message);
[[nodiscard]] Bytes encode(const TagArray& message);
/// Encodes one ray per element of `ranges`; the other lists must have the same length.
[[nodiscard]] Bytes encode(const Lidar& message);
[[nodiscard]] Bytes encode(const Timestamp& message);

}  // namespace waymark::mbot

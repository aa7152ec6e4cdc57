#include "waymark/recording/lcm/mbot_messages.hpp"

#include <algorithm>
#include <utility>

#include "waymark/recording/byte_io.hpp"

namespace waymark::mbot {
namespace {

struct Type {
  std::uint64_t fingerprint;
  std::string_view name;
  bool stamped = false;  ///< the message begins with utime
};
constexpr std::array kTypes = {
    Type{kPose2D, "pose2D_t", true},
    Type{kTwist2D, "twist2D_t", true},
    Type{kEncoders, "mbot_encoders_t", true},
    Type{kImu, "mbot_imu_t", true},
    Type{kTagArray, "mbot_apriltag_array_t", true},
    Type{kLidar, "lidar_t", true},
    Type{0x8119c7c9136961b1, "mbot_motor_vel_t", true},
    Type{0x76800874d953b1e9, "mbot_motor_pwm_t", true},
    Type{kTimestamp, "timestamp_t", true},
    Type{0xa45a83d6c1ab3dd6, "slam_status_t", true},
    Type{0x183436663a799608, "point3D_t"},
    Type{0x73dcef9fdef937d7, "twist3D_t"},
    Type{0x823ab9f4be9f4706, "joy_t"},
    Type{0xacc8b8b271c80480, "particle_t"},
    Type{0xe2a767ec6d2ab420, "particles_t"},
    Type{0xefadf583af374079, "path2D_t"},
    Type{0xf0e8bae380b1d5fa, "planner_request_t"},
    Type{0xd5447e494a66cc92, "occupancy_grid_t"},
    Type{0x734fe8798a71f022, "mbot_analog_t"},
    Type{0x41b599f392e6d5c1, "mbot_slam_reset_t"},
    Type{0x1eae5c6080a6edc7, "mbot_message_received_t"},
    Type{0x046ac19319764a5d, "exploration_status_t"},
    Type{0x94400f849f3dfca4, "mbot_cone_t"},
    Type{0x44c9680399d2d07e, "mbot_cone_array_t"},
};

void read(BigEndianReader& in, Pose2D& out) {
  out.x = in.number<float>();
  out.y = in.number<float>();
  out.theta = in.number<float>();
}
void read(BigEndianReader& in, Twist2D& out) {
  out.vx = in.number<float>();
  out.vy = in.number<float>();
  out.wz = in.number<float>();
}
void read(BigEndianReader& in, Encoders& out) {
  in.numbers(out.ticks);
  in.numbers(out.delta_ticks);
  out.delta_time = in.number<std::int32_t>();
}
void read(BigEndianReader& in, Imu& out) {
  in.numbers(out.gyro);
  in.numbers(out.accel);
  in.numbers(out.mag);
  in.numbers(out.angles_rpy);
  in.numbers(out.angles_quat);
  out.temp = in.number<float>();
}
void read(BigEndianReader& in, TagArray& out) {
  constexpr std::size_t kTagSize = 52;
  const auto count = in.number<std::int32_t>();
  const std::size_t fits = in.remaining() / kTagSize;
  for (std::size_t i = 0; i < fits && std::cmp_less(i, count); ++i) {
    Tag& tag = out.tags.emplace_back();
    tag.id = in.number<std::int32_t>();
    tag.utime = in.number<std::int64_t>();
    in.numbers(tag.position);
    in.numbers(tag.angles_rpy);
    in.numbers(tag.angles_quat);
  }
  if (!std::cmp_equal(out.tags.size(), count)) in.fail();
}
void read(BigEndianReader& in, Lidar& out) {
  const auto count = static_cast<std::uint64_t>(std::max(0, in.number<std::int32_t>()));
  in.numbers(out.ranges, count);
  in.numbers(out.thetas, count);
  in.numbers(out.times, count);
  in.numbers(out.intensities, count);
}

void read(BigEndianReader& /*in*/, Timestamp& /*contains only utime*/) {}

template <class Message>
constexpr std::uint64_t fingerprint();
template <>
constexpr std::uint64_t fingerprint<Pose2D>() {
  return kPose2D;
}
template <>
constexpr std::uint64_t fingerprint<Twist2D>() {
  return kTwist2D;
}
template <>
constexpr std::uint64_t fingerprint<Encoders>() {
  return kEncoders;
}
template <>
constexpr std::uint64_t fingerprint<Imu>() {
  return kImu;
}
template <>
constexpr std::uint64_t fingerprint<TagArray>() {
  return kTagArray;
}
template <>
constexpr std::uint64_t fingerprint<Lidar>() {
  return kLidar;
}
template <>
constexpr std::uint64_t fingerprint<Timestamp>() {
  return kTimestamp;
}

template <class Message>
BigEndianWriter begin(const Message& message) {
  BigEndianWriter out;
  out.number(fingerprint<Message>());
  out.number(message.utime);
  return out;
}

}  // namespace

std::string_view type_name(std::uint64_t fingerprint) {
  const auto type = std::ranges::find(kTypes, fingerprint, &Type::fingerprint);
  return type == kTypes.end() ? std::string_view() : type->name;
}

std::optional<std::int64_t> utime_of(ByteSpan payload) {
  BigEndianReader in(payload);
  const auto type = std::ranges::find(kTypes, in.number<std::uint64_t>(), &Type::fingerprint);
  const auto utime = in.number<std::int64_t>();
  return type == kTypes.end() || !type->stamped || in.failed() ? std::nullopt : std::optional(utime);
}

std::uint64_t fingerprint_of(ByteSpan payload) { return BigEndianReader(payload).number<std::uint64_t>(); }

template <class Message>
std::optional<Message> decode(ByteSpan payload) {
  BigEndianReader in(payload);
  if (in.number<std::uint64_t>() != fingerprint<Message>()) return std::nullopt;
  Message message;
  message.utime = in.number<std::int64_t>();
  read(in, message);
  if (in.failed() || in.remaining() != 0) return std::nullopt;
  return message;
}
template std::optional<Pose2D> decode(ByteSpan);
template std::optional<Twist2D> decode(ByteSpan);
template std::optional<Encoders> decode(ByteSpan);
template std::optional<Imu> decode(ByteSpan);
template std::optional<TagArray> decode(ByteSpan);
template std::optional<Lidar> decode(ByteSpan);
template std::optional<Timestamp> decode(ByteSpan);

Bytes encode(const Pose2D& message) {
  BigEndianWriter out = begin(message);
  out.numbers(std::array{message.x, message.y, message.theta});
  return out.take();
}

Bytes encode(const Twist2D& message) {
  BigEndianWriter out = begin(message);
  out.numbers(std::array{message.vx, message.vy, message.wz});
  return out.take();
}

Bytes encode(const Encoders& message) {
  BigEndianWriter out = begin(message);
  out.numbers(message.ticks);
  out.numbers(message.delta_ticks);
  out.number(message.delta_time);
  return out.take();
}

Bytes encode(const Imu& message) {
  BigEndianWriter out = begin(message);
  for (const auto& vector : {message.gyro, message.accel, message.mag, message.angles_rpy})
    out.numbers(vector);
  out.numbers(message.angles_quat);
  out.number(message.temp);
  return out.take();
}

Bytes encode(const TagArray& message) {
  BigEndianWriter out = begin(message);
  out.number(static_cast<std::int32_t>(message.tags.size()));
  for (const Tag& tag : message.tags) {
    out.number(tag.id);
    out.number(tag.utime);
    out.numbers(tag.position);
    out.numbers(tag.angles_rpy);
    out.numbers(tag.angles_quat);
  }
  return out.take();
}

Bytes encode(const Lidar& message) {
  BigEndianWriter out = begin(message);
  out.number(static_cast<std::int32_t>(message.ranges.size()));
  out.numbers(message.ranges);
  out.numbers(message.thetas);
  out.numbers(message.times);
  out.numbers(message.intensities);
  return out.take();
}

Bytes encode(const Timestamp& message) { return begin(message).take(); }

}  // namespace waymark::mbot

#include "waymark/robots/limo/limo_messages.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

constexpr std::array<std::uint8_t, 2> kHeader = {0x55, 0x0E};

LimoFrame frame_of(std::span<const std::uint8_t> bytes) {
  LimoFrame frame{.id = static_cast<std::uint16_t>((bytes[2] << 8U) | bytes[3]), .count = bytes[12]};
  std::copy_n(bytes.begin() + 4, frame.data.size(), frame.data.begin());
  return frame;
}

/// Whether the bytes are the beginning of a header.
bool begins(std::span<const std::uint8_t> bytes) {
  const std::size_t size = std::min(bytes.size(), kHeader.size());
  return std::equal(kHeader.begin(), kHeader.begin() + static_cast<std::ptrdiff_t>(size), bytes.begin());
}

}  // namespace

std::uint8_t checksum(const LimoFrame& frame) {
  return static_cast<std::uint8_t>(std::accumulate(frame.data.begin(), frame.data.end(), 0U));
}

std::array<std::uint8_t, kLimoFrameBytes> encode(const LimoFrame& frame) {
  std::array<std::uint8_t, kLimoFrameBytes> bytes{kHeader[0], kHeader[1],
                                                  static_cast<std::uint8_t>(frame.id >> 8U),
                                                  static_cast<std::uint8_t>(frame.id & 0xFFU)};
  std::ranges::copy(frame.data, bytes.begin() + 4);
  bytes[12] = frame.count;
  bytes[13] = checksum(frame);
  return bytes;
}

std::optional<LimoFrame> LimoReader::next() {
  std::size_t at = 0;
  std::optional<LimoFrame> found;
  while (!found && at < bytes_.size()) {
    const auto rest = std::span<const std::uint8_t>(bytes_).subspan(at);
    if (begins(rest)) {
      if (rest.size() < kLimoFrameBytes) break;  // the rest may not have arrived yet
      const LimoFrame frame = frame_of(rest);
      if (checksum(frame) == rest[13]) {
        found = frame;
        break;
      }
    }
    ++at;
  }
  skipped_ += at;
  const std::size_t taken = at + (found ? kLimoFrameBytes : 0);
  bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(taken));
  return found;
}

namespace {

constexpr double kMilli = 1e-3;
constexpr double kCentidegree = 0.01 * std::numbers::pi / 180;
constexpr double kCenti = 0.01;

constexpr std::array kDriveNames = {"differential", "ackermann", "mecanum", "tracked"};

double int16_at(const LimoFrame& frame, std::size_t at) {
  const auto raw = static_cast<std::uint16_t>((frame.data.at(at) << 8U) | frame.data.at(at + 1));
  return std::bit_cast<std::int16_t>(raw);
}

/// Rounds and clamps to the range of the integer type; returns zero for non-finite values.
template <class Integer>
Integer whole(double value) {
  if (!std::isfinite(value)) return 0;
  return static_cast<Integer>(std::clamp(std::round(value),
                                         static_cast<double>(std::numeric_limits<Integer>::min()),
                                         static_cast<double>(std::numeric_limits<Integer>::max())));
}

void put16(LimoFrame& frame, std::size_t at, std::uint16_t value) {
  frame.data.at(at) = static_cast<std::uint8_t>(value >> 8U);
  frame.data.at(at + 1) = static_cast<std::uint8_t>(value & 0xFFU);
}

LimoFrame frame_of(LimoId id, const std::array<double, 4>& values) {
  LimoFrame frame{.id = static_cast<std::uint16_t>(id)};
  for (std::size_t k = 0; k < values.size(); ++k)
    put16(frame, 2 * k, std::bit_cast<std::uint16_t>(whole<std::int16_t>(values.at(k))));
  return frame;
}

std::int32_t int32_at(const LimoFrame& frame, std::size_t at) {
  std::uint32_t raw = 0;
  for (std::size_t k = at; k < at + 4; ++k) raw = (raw << 8U) | frame.data.at(k);
  return std::bit_cast<std::int32_t>(raw);
}

Eigen::Vector3d vector_of(const LimoFrame& frame, double unit) {
  return unit * Eigen::Vector3d(int16_at(frame, 0), int16_at(frame, 2), int16_at(frame, 4));
}

LimoFrame frame_of_vector(LimoId id, const Eigen::Vector3d& value, double unit) {
  return frame_of(id, {value.x() / unit, value.y() / unit, value.z() / unit, 0});
}

}  // namespace

const char* to_string(LimoDrive drive) { return kDriveNames.at(static_cast<std::size_t>(drive)); }

Result<LimoDrive> parse_limo_drive(const std::string& name) {
  const auto* const found = std::ranges::find(kDriveNames, name);
  if (found == kDriveNames.end())
    return fail(ErrorCode::InvalidArgument, "unknown drive '" + name + "'", {.key = "drive"},
                suggestion(name, {kDriveNames.begin(), kDriveNames.end()}));
  return static_cast<LimoDrive>(found - kDriveNames.begin());
}

Result<LimoMotion> decode_motion(const LimoFrame& frame) {
  constexpr double kMaxSpeed_m_s = 3;
  constexpr double kMaxYawRate_rad_s = 15;
  const LimoMotion motion{.speed_m_s = kMilli * int16_at(frame, 0),
                          .yaw_rate_rad_s = kMilli * int16_at(frame, 2),
                          .lateral_m_s = kMilli * int16_at(frame, 4),
                          .steering_rad = kLimoSteeringScale * kMilli * int16_at(frame, 6)};
  if (std::abs(motion.speed_m_s) > kMaxSpeed_m_s || std::abs(motion.lateral_m_s) > kMaxSpeed_m_s ||
      std::abs(motion.yaw_rate_rad_s) > kMaxYawRate_rad_s ||
      std::abs(motion.steering_rad) > std::numbers::pi / 2)
    return fail(ErrorCode::Unreadable, "motion outside the range of a LIMO");
  return motion;
}

Result<LimoState> decode_state(const LimoFrame& frame) {
  constexpr std::uint8_t kMaxControlMode = 3;
  constexpr std::uint8_t kCommanded = 1;
  const LimoState state{.vehicle = static_cast<LimoState::Vehicle>(std::min<int>(frame.data[0], 2)),
                        .commanded = frame.data[1] == kCommanded,
                        .battery_V = 0.1 * static_cast<std::uint16_t>((frame.data[2] << 8U) | frame.data[3]),
                        .errors = static_cast<std::uint16_t>((frame.data[4] << 8U) | frame.data[5]),
                        .drive = static_cast<LimoDrive>(std::min<int>(frame.data[6], 2))};
  constexpr double kMaxBattery_V = 30;
  if (frame.data[0] > 2 || frame.data[1] > kMaxControlMode || frame.data[6] > 2 ||
      state.battery_V > kMaxBattery_V)
    return fail(ErrorCode::Unreadable, "invalid state");
  return state;
}

LimoOdometer decode_odometer(const LimoFrame& frame) {
  return {.left_m = kMilli * int32_at(frame, 0), .right_m = kMilli * int32_at(frame, 4)};
}

Eigen::Vector3d decode_acceleration_m_s2(const LimoFrame& frame) { return vector_of(frame, kCenti); }
Eigen::Vector3d decode_angular_velocity_rad_s(const LimoFrame& frame) {
  return vector_of(frame, kCentidegree);
}
Eigen::Vector3d decode_attitude_rad(const LimoFrame& frame) { return vector_of(frame, kCentidegree); }

LimoFrame encode_motion_feedback(const LimoMotion& motion) {
  return frame_of(LimoId::MotionFeedback,
                  {motion.speed_m_s / kMilli, motion.yaw_rate_rad_s / kMilli, motion.lateral_m_s / kMilli,
                   motion.steering_rad / kLimoSteeringScale / kMilli});
}

LimoFrame encode_state(const LimoState& state) {
  LimoFrame frame{.id = static_cast<std::uint16_t>(LimoId::State)};
  frame.data[0] = static_cast<std::uint8_t>(state.vehicle);
  frame.data[1] = state.commanded ? 1 : 0;
  put16(frame, 2, whole<std::uint16_t>(10 * state.battery_V));
  put16(frame, 4, state.errors);
  frame.data[6] = state.drive == LimoDrive::Tracked ? 0 : static_cast<std::uint8_t>(state.drive);
  return frame;
}

LimoFrame encode_odometer(const LimoOdometer& odometer) {
  LimoFrame frame{.id = static_cast<std::uint16_t>(LimoId::Odometer)};
  std::size_t at = 0;
  for (const double side_m : {odometer.left_m, odometer.right_m}) {
    const auto raw = std::bit_cast<std::uint32_t>(whole<std::int32_t>(side_m / kMilli));
    put16(frame, at, static_cast<std::uint16_t>(raw >> 16U));
    put16(frame, at + 2, static_cast<std::uint16_t>(raw & 0xFFFFU));
    at += 4;
  }
  return frame;
}

LimoFrame encode_acceleration(const Eigen::Vector3d& acceleration_m_s2) {
  return frame_of_vector(LimoId::Acceleration, acceleration_m_s2, kCenti);
}
LimoFrame encode_angular_velocity(const Eigen::Vector3d& angular_velocity_rad_s) {
  return frame_of_vector(LimoId::AngularVelocity, angular_velocity_rad_s, kCentidegree);
}
LimoFrame encode_attitude(const Eigen::Vector3d& yaw_pitch_roll_rad) {
  return frame_of_vector(LimoId::Attitude, yaw_pitch_roll_rad, kCentidegree);
}

LimoFrame take_command(LimoDrive drive) {
  LimoFrame frame{.id = static_cast<std::uint16_t>(LimoId::ControlMode)};
  frame.data[0] = 1;
  frame.data[2] = drive == LimoDrive::Mecanum ? 1 : 0;
  return frame;
}

double curvature_of_steering(double steering_rad) {
  const double tangent = std::tan(std::abs(steering_rad));
  const double curvature = tangent / (kLimoWheelbase_m + (kLimoTrack_m / 2) * tangent);
  return std::copysign(curvature, steering_rad);
}

double steering_of_curvature(double curvature) {
  const double size = std::abs(curvature);
  const double below =
      1 - size * kLimoTrack_m / 2;  // zero or negative if the turning centre is at or inside the inner wheel
  const double steering =
      below > 0 ? std::atan2(size * kLimoWheelbase_m, below) : std::numeric_limits<double>::infinity();
  return std::copysign(std::min(steering, kLimoMaxSteering_rad), curvature);
}

LimoFrame encode_command(const VelocityCommand& command, LimoDrive drive) {
  const bool finite = std::isfinite(command.speed_m_s) && std::isfinite(command.yaw_rate_rad_s);
  const VelocityCommand asked = finite ? command : VelocityCommand{};
  const double speed_m_s = std::clamp(asked.speed_m_s, -kLimoTopSpeed_m_s, kLimoTopSpeed_m_s);
  if (drive != LimoDrive::Ackermann)
    return frame_of(LimoId::Motion, {speed_m_s / kMilli, asked.yaw_rate_rad_s / kMilli, 0, 0});
  // Uses the curvature of the command, not the curvature at the clamped speed.
  const double curvature =
      asked.yaw_rate_rad_s == 0
          ? 0
          : asked.yaw_rate_rad_s /
                (asked.speed_m_s == 0 ? std::numeric_limits<double>::min() : asked.speed_m_s);
  const double steering_rad = steering_of_curvature(curvature) / kLimoSteeringScale;
  return frame_of(LimoId::Motion, {speed_m_s / kMilli, 0, 0, steering_rad / kMilli});
}

VelocityCommand decode_command(const LimoFrame& frame, LimoDrive drive) {
  const double speed_m_s = kMilli * int16_at(frame, 0);
  if (drive != LimoDrive::Ackermann) return {speed_m_s, kMilli * int16_at(frame, 2)};
  return {speed_m_s, speed_m_s * curvature_of_steering(kLimoSteeringScale * kMilli * int16_at(frame, 6))};
}

std::vector<std::string> limo_error_texts(std::uint16_t errors) {
  constexpr std::array kTexts = {"the battery is nearly empty",
                                 "the battery is low",
                                 "no signal from the remote control",
                                 "motor 1 has an error",
                                 "motor 2 has an error",
                                 "motor 3 has an error",
                                 "motor 4 has an error",
                                 "the steering has an error",
                                 "the drive has an error",
                                 "the mainboard receives nothing from the computer"};
  std::vector<std::string> texts;
  for (std::size_t bit = 0; bit < 16; ++bit) {
    if ((errors & (1U << bit)) == 0) continue;
    texts.push_back(bit < kTexts.size() ? kTexts.at(bit) : "unknown error bit " + std::to_string(bit));
  }
  return texts;
}

}  // namespace waymark

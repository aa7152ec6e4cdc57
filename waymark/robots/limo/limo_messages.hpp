#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot_samples.hpp"

/// The serial protocol of AgileX LIMO: frames of 14 bytes at 460800 baud, 8N1. Source: AgileX Robotics,
/// limo_ros2, limo_base/include/limo_base/limo_protocol.h and src/limo_driver.cpp. A frame consists of 0x55,
/// 0x0E, message id (2 bytes), 8 bytes of data, a counter, and the sum of the data modulo 256. Numbers are
/// big-endian.
namespace waymark {

/// The message ids used here.
enum class LimoId : std::uint16_t {
  Motion = 0x111,       ///< to the robot: speed, yaw rate, lateral speed, steering angle
  ControlMode = 0x421,  ///< to the robot: requests control
  State = 0x211,
  MotionFeedback = 0x221,
  Odometer = 0x311,
  Acceleration = 0x321,
  AngularVelocity = 0x322,
  Attitude = 0x323,
};

inline constexpr std::size_t kLimoFrameBytes = 14;

struct LimoFrame {
  std::uint16_t id = 0;
  std::array<std::uint8_t, 8> data{};
  std::uint8_t count = 0;

  friend bool operator==(const LimoFrame&, const LimoFrame&) = default;
};

/// The sum of the data modulo 256.
[[nodiscard]] std::uint8_t checksum(const LimoFrame& frame);
[[nodiscard]] std::array<std::uint8_t, kLimoFrameBytes> encode(const LimoFrame& frame);

/// Finds frames in a byte stream. After a frame with a wrong checksum it skips only one byte, so that a frame
/// beginning inside a damaged one is found. Buffers at most one frame and the bytes from the last add().
class LimoReader {
 public:
  void add(std::span<const std::uint8_t> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  /// The next complete frame.
  [[nodiscard]] std::optional<LimoFrame> next();
  /// Number of bytes so far that did not belong to any frame.
  [[nodiscard]] std::uint64_t skipped() const { return skipped_; }

 private:
  std::vector<std::uint8_t> bytes_{};
  std::uint64_t skipped_ = 0;
};

// Decodes and encodes LIMO's frames, in SI units (limo_driver.cpp in AgileX Robotics' limo_ros2).

/// LIMO's drive, determined by how its wheels are mounted and latched. With tracks, LIMO reports
/// Differential.
enum class LimoDrive : std::uint8_t { Differential, Ackermann, Mecanum, Tracked };

/// "differential", "ackermann", "mecanum", "tracked".
[[nodiscard]] const char* to_string(LimoDrive drive);
[[nodiscard]] Result<LimoDrive> parse_limo_drive(const std::string& name);

/// Dimensions and limits of LIMO (LIMO user manual, section 1.3; limo_driver.h).
inline constexpr double kLimoTopSpeed_m_s = 1.0;
inline constexpr double kLimoWheelbase_m = 0.2;
inline constexpr double kLimoTrack_m = 0.172;
inline constexpr double kLimoMaxSteering_rad = 0.48869;  ///< angle of the inner wheel
inline constexpr double kLimoSteeringScale = 2.47;  ///< ratio of inner wheel angle to angle in the message

/// 0x221: motion measured by the wheels.
struct LimoMotion {
  double speed_m_s = 0;
  double yaw_rate_rad_s = 0;
  double lateral_m_s = 0;   ///< to the left, for Mecanum wheels
  double steering_rad = 0;  ///< of the inner front wheel, positive to the left, for Ackermann steering
};

/// 0x211.
struct LimoState {
  enum class Vehicle : std::uint8_t { Normal, EmergencyStop, Exception };
  Vehicle vehicle = Vehicle::Normal;
  bool commanded = false;  ///< whether LIMO accepts commands from this port; if false, only from the remote
                           ///< control or not at all
  double battery_V = 0;
  std::uint16_t errors = 0;
  LimoDrive drive = LimoDrive::Differential;
};

/// 0x311: distance rolled by the wheels on each side since power-on.
struct LimoOdometer {
  double left_m = 0;
  double right_m = 0;
};

/// Fails if values are implausible, as in a damaged frame whose checksum happens to be correct.
[[nodiscard]] Result<LimoMotion> decode_motion(const LimoFrame& frame);
[[nodiscard]] Result<LimoState> decode_state(const LimoFrame& frame);
[[nodiscard]] LimoOdometer decode_odometer(const LimoFrame& frame);
[[nodiscard]] Eigen::Vector3d decode_acceleration_m_s2(const LimoFrame& frame);
[[nodiscard]] Eigen::Vector3d decode_angular_velocity_rad_s(const LimoFrame& frame);
/// Yaw, pitch and roll, counter-clockwise.
[[nodiscard]] Eigen::Vector3d decode_attitude_rad(const LimoFrame& frame);

[[nodiscard]] LimoFrame encode_motion_feedback(const LimoMotion& motion);
[[nodiscard]] LimoFrame encode_state(const LimoState& state);
[[nodiscard]] LimoFrame encode_odometer(const LimoOdometer& odometer);
[[nodiscard]] LimoFrame encode_acceleration(const Eigen::Vector3d& acceleration_m_s2);
[[nodiscard]] LimoFrame encode_angular_velocity(const Eigen::Vector3d& angular_velocity_rad_s);
[[nodiscard]] LimoFrame encode_attitude(const Eigen::Vector3d& yaw_pitch_roll_rad);

/// 0x421: requests control. Mecanum wheels must be declared; LIMO detects the other drives from its latches.
[[nodiscard]] LimoFrame take_command(LimoDrive drive);
/// 0x111 for a velocity of the body, limited to LIMO's maximum speed. With Ackermann steering, the angle of
/// the inner front wheel is computed from the curvature (yaw rate / speed) and limited to its maximum.
/// Turning on the spot is then impossible: the wheels steer, but the robot does not move.
[[nodiscard]] LimoFrame encode_command(const VelocityCommand& command, LimoDrive drive);
/// The velocity of the body in a 0x111 frame; the inverse of encode_command().
[[nodiscard]] VelocityCommand decode_command(const LimoFrame& frame, LimoDrive drive);

/// Converts the angle of the inner front wheel [rad] to the path curvature at the midpoint of the rear axle
/// [1/m], positive to the left, and back.
[[nodiscard]] double curvature_of_steering(double steering_rad);
[[nodiscard]] double steering_of_curvature(double curvature);

/// The bits in LimoState::errors that prohibit driving: motors, steering, drive.
inline constexpr std::uint16_t kLimoStoppingErrors = 0x01F8;
/// One message for each error bit that is set.
[[nodiscard]] std::vector<std::string> limo_error_texts(std::uint16_t errors);

}  // namespace waymark

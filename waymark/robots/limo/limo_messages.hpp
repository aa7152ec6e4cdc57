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

/// The serial wire of AgileX LIMO: frames of 14 bytes at 460800 baud, 8N1 (AgileX Robotics, limo_ros2,
/// limo_base/include/limo_base/limo_protocol.h and src/limo_driver.cpp): 0x55, 0x0E, number of the message
/// (2 bytes), 8 bytes of data, a counter, and the sum of the data modulo 256. Numbers are big-endian.
namespace waymark {

/// The messages of the wire that are used here.
enum class LimoId : std::uint16_t {
  Motion = 0x111,       ///< to the robot: speed, yaw rate, lateral speed, steering
  ControlMode = 0x421,  ///< to the robot: who commands it
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

/// Finds frames in bytes as they come. A header whose checksum is wrong is passed over by one byte only, so
/// that a frame which begins inside a damaged one is found. Holds no more than a frame and what add() gave.
class LimoReader {
 public:
  void add(std::span<const std::uint8_t> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  /// The oldest whole frame that was not taken yet.
  [[nodiscard]] std::optional<LimoFrame> next();
  /// Bytes so far that belonged to no frame.
  [[nodiscard]] std::uint64_t skipped() const { return skipped_; }

 private:
  std::vector<std::uint8_t> bytes_{};
  std::uint64_t skipped_ = 0;
};

// What the frames of LIMO say, both ways, in SI units (limo_driver.cpp of AgileX Robotics' limo_ros2).

/// How its wheels are mounted and latched. With tracks it reports Differential.
enum class LimoDrive : std::uint8_t { Differential, Ackermann, Mecanum, Tracked };

/// "differential", "ackermann", "mecanum", "tracked".
[[nodiscard]] const char* to_string(LimoDrive drive);
[[nodiscard]] Result<LimoDrive> parse_limo_drive(const std::string& name);

/// Of the body and of the wire (LIMO user manual, section 1.3; limo_driver.h).
inline constexpr double kLimoTopSpeed_m_s = 1.0;
inline constexpr double kLimoWheelbase_m = 0.2;
inline constexpr double kLimoTrack_m = 0.172;
inline constexpr double kLimoMostSteering_rad = 0.48869;  ///< of the inner wheel
inline constexpr double kLimoSteeringScale = 2.47;        ///< angle of the inner wheel over that of the wire

/// 0x221: what the wheels do.
struct LimoMotion {
  double speed_m_s = 0;
  double yaw_rate_rad_s = 0;
  double lateral_m_s = 0;   ///< to the left; with Mecanum wheels
  double steering_rad = 0;  ///< of the inner front wheel, to the left; with Ackermann steering
};

/// 0x211.
struct LimoState {
  enum class Vehicle : std::uint8_t { Normal, EmergencyStop, Exception };
  Vehicle vehicle = Vehicle::Normal;
  bool commanded = false;  ///< it obeys this wire; otherwise the remote control or nobody
  double battery_V = 0;
  std::uint16_t errors = 0;
  LimoDrive drive = LimoDrive::Differential;
};

/// 0x311: how far the wheels of each side have rolled since it was switched on.
struct LimoOdometer {
  double left_m = 0;
  double right_m = 0;
};

/// Fails on numbers that no LIMO can mean: a damaged frame whose checksum is right by chance.
[[nodiscard]] Result<LimoMotion> decode_motion(const LimoFrame& frame);
[[nodiscard]] Result<LimoState> decode_state(const LimoFrame& frame);
[[nodiscard]] LimoOdometer decode_odometer(const LimoFrame& frame);
[[nodiscard]] Eigen::Vector3d decode_acceleration_m_s2(const LimoFrame& frame);
[[nodiscard]] Eigen::Vector3d decode_angular_velocity_rad_s(const LimoFrame& frame);
/// Yaw, pitch, roll; counter-clockwise.
[[nodiscard]] Eigen::Vector3d decode_attitude_rad(const LimoFrame& frame);

[[nodiscard]] LimoFrame encode_motion_feedback(const LimoMotion& motion);
[[nodiscard]] LimoFrame encode_state(const LimoState& state);
[[nodiscard]] LimoFrame encode_odometer(const LimoOdometer& odometer);
[[nodiscard]] LimoFrame encode_acceleration(const Eigen::Vector3d& acceleration_m_s2);
[[nodiscard]] LimoFrame encode_angular_velocity(const Eigen::Vector3d& angular_velocity_rad_s);
[[nodiscard]] LimoFrame encode_attitude(const Eigen::Vector3d& yaw_pitch_roll_rad);

/// 0x421: this wire commands it. Mecanum wheels must be announced, the other drives are seen by the latches.
[[nodiscard]] LimoFrame take_command(LimoDrive drive);
/// 0x111 of a command of the body: no faster than the robot can, and with Ackermann steering by the angle of
/// the inner front wheel for the curvature yaw rate over speed, no tighter than it steers. A turn on the spot
/// is not possible then: the wheels steer and the robot stands.
[[nodiscard]] LimoFrame encode_command(const VelocityCommand& command, LimoDrive drive);
/// What a frame 0x111 asks the body to do; the inverse of encode_command().
[[nodiscard]] VelocityCommand decode_command(const LimoFrame& frame, LimoDrive drive);

/// Curvature of the middle of the rear axle [1/m], to the left, for the inner front wheel's angle, and back.
[[nodiscard]] double curvature_of_steering(double steering_rad);
[[nodiscard]] double steering_of_curvature(double curvature);

/// The bits of LimoState::errors that forbid driving: motors, steering, drive.
inline constexpr std::uint16_t kLimoStoppingErrors = 0x01F8;
/// The error bits that are set, each in words.
[[nodiscard]] std::vector<std::string> error_words(std::uint16_t errors);

}  // namespace waymark

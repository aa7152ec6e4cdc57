#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/robots/limo/limo_frame.hpp"
#include "waymark/samples/robot_samples.hpp"

/// What the frames of LIMO say, both ways, in SI units (limo_driver.cpp of AgileX Robotics' limo_ros2).
namespace waymark {

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

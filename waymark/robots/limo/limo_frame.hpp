#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

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

}  // namespace waymark

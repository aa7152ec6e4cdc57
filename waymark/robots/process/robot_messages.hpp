#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Base64 according to RFC 4648, section 4, with padding.
[[nodiscard]] std::string encode_base64(std::span<const std::uint8_t> bytes);
/// `nullopt` if a character is not in the alphabet, or if the length or the padding is wrong.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> decode_base64(std::string_view text);

/// Version of the protocol in docs/formats/robot-process.md.
inline constexpr std::int64_t kRobotProtocol = 1;

/// The first line sent by a robot.
struct RobotHello {
  std::int64_t protocol_version = kRobotProtocol;
  std::string name{};
  std::vector<std::string> sends{};  ///< types of the lines that the robot will send
  bool lockstep = false;             ///< whether its time does not advance until each step is answered
  bool simulated_time = false;       ///< whether its newest timestamp is its time, instead of a clock
  bool simulated = false;  ///< whether the robot is not real; a robot in lockstep is always simulated

  [[nodiscard]] bool is_real() const { return !lockstep && !simulated && !simulated_time; }
};

/// A robot in lockstep is waiting for the command for this step.
struct RobotStep {
  std::int64_t step = 0;
  SensorTime stamp{};
};

/// A message for the operator.
struct RobotLog {
  std::string text{};
};

using RobotMessage = std::variant<RobotHello, RobotStep, RobotLog, Sample>;

class MessageFields;

/// Parses the lines sent by a robot. Strict: an invalid line is an error that contains line and key, because
/// a robot with partly unreadable data must not be driven. Unknown keys and types are ignored, with one
/// warning each.
class RobotMessageReader {
 public:
  /// `name` is the robot's name in errors; `cameras` contains the names of its cameras, any if empty.
  explicit RobotMessageReader(std::string name, std::vector<std::string> cameras = {})
      : name_(std::move(name)), cameras_(std::move(cameras)) {}

  /// The message in a line; `nullopt` for an empty line and for an unknown type. Images are read and decoded.
  /// Unreadable images and lines from unknown cameras are skipped, counted, and reported as warnings.
  [[nodiscard]] Result<std::optional<RobotMessage>> read(const Line& line);
  /// The warnings since the last call.
  [[nodiscard]] std::vector<std::string> take_warnings() { return std::exchange(warnings_, {}); }

 private:
  friend class MessageFields;
  void warn_once(const std::string& warning);
  void warn_skipped(std::int64_t line, const MessageFields& fields);

  std::string name_;
  std::vector<std::string> cameras_;
  std::set<std::string> warned_{};
  std::vector<std::string> warnings_{};
  bool greeted_ = false;
  unsigned unreadable_images_ = 0;
  unsigned unknown_cameras_ = 0;                ///< number of lines from unknown cameras
  std::map<std::string, SensorTime> newest_{};  ///< newest timestamp by type and camera
};

/// The line for a message, including its newline. For an image, `image` contains the bytes of a JPEG or PNG
/// file. Empty for samples that have no line (ranges, commands).
[[nodiscard]] std::string to_line(const RobotMessage& message, const std::vector<std::uint8_t>& image = {});

/// An order to the robot, as parsed by its process.
struct RobotOrderLine {
  enum class Kind : std::uint8_t { Hello, Velocity, Bye, Other };
  Kind kind = Kind::Other;
  VelocityCommand command{};
  std::int64_t step = 0;
  bool by_watchdog = false;
  bool listen_only = false;  ///< hello only: no velocity will follow, because another program drives
};
[[nodiscard]] RobotOrderLine parse_order_line(const std::string& text);

}  // namespace waymark

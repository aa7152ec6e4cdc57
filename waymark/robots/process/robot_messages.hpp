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

/// Base64 of RFC 4648, section 4, with padding.
[[nodiscard]] std::string encode_base64(std::span<const std::uint8_t> bytes);
/// Empty if a character is not in the alphabet, or the length or the padding is wrong.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> decode_base64(std::string_view text);

/// Protocol version of docs/formats/robot-process.md.
inline constexpr std::int64_t kRobotProtocol = 1;

/// The first line of a robot.
struct RobotHello {
  std::int64_t protocol_version = kRobotProtocol;
  std::string name{};
  std::vector<std::string> sends{};  ///< types of the lines that it will send
  bool lockstep = false;             ///< its time does not advance until each step is answered
  bool simulated_time = false;       ///< its time is the stamp of its newest sample, not a clock
  bool simulated = false;            ///< not a real robot; a robot in lockstep is always simulated

  [[nodiscard]] bool is_real() const { return !lockstep && !simulated && !simulated_time; }
};

/// A robot in lockstep waits for the command of this step.
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

/// Parses the lines of a robot. Strict: an invalid line is an error that contains line and key, because a
/// robot with partly unreadable data must not be driven. Unknown keys and types are ignored with one warning
/// each.
class RobotMessageReader {
 public:
  /// `name`: the robot's name in errors; `cameras`: names of its cameras, empty: any.
  explicit RobotMessageReader(std::string name, std::vector<std::string> cameras = {})
      : name_(std::move(name)), cameras_(std::move(cameras)) {}

  /// The message of a line; empty for an empty line and for an unknown type. Images are read and decoded.
  /// Unreadable images and lines of unknown cameras are skipped, counted, and reported as warnings.
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
  unsigned unreadable_pictures_ = 0;
  unsigned unknown_cameras_ = 0;                ///< number of their lines
  std::map<std::string, SensorTime> newest_{};  ///< by type, and camera
};

/// The line of a message, with its newline. `picture`: for an image, the bytes of a JPEG or PNG file. Empty
/// for samples that have no line (ranges, commands).
[[nodiscard]] std::string to_line(const RobotMessage& message, const std::vector<std::uint8_t>& picture = {});

/// An order to the robot, as its process parses it.
struct RobotOrderLine {
  enum class Kind : std::uint8_t { Hello, Velocity, Bye, Other };
  Kind kind = Kind::Other;
  VelocityCommand command{};
  std::int64_t step = 0;
  bool by_watchdog = false;
  bool listen_only = false;  ///< hello only: no velocity will follow, another program drives
};
[[nodiscard]] RobotOrderLine parse_order_line(const std::string& text);

}  // namespace waymark

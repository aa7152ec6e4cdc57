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

/// RFC 4648, section 4, with padding.
[[nodiscard]] std::string encode_base64(std::span<const std::uint8_t> bytes);
/// Nothing when a character is none of the alphabet, or the length or the padding is wrong.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> decode_base64(std::string_view text);

/// Of docs/formats/robot-process.md.
inline constexpr std::int64_t kRobotProtocol = 1;

/// The first line of a robot.
struct RobotHello {
  std::int64_t protocol_version = kRobotProtocol;
  std::string name{};
  std::vector<std::string> sends{};  ///< types of the lines that will come
  bool lockstep = false;             ///< its time stands still until each step is answered
  bool simulated_time = false;       ///< its time goes as fast as its samples say, not as that of a clock
  bool simulated = false;            ///< no wheels turn; a robot in lockstep is simulated, whatever it says

  [[nodiscard]] bool is_real() const { return !lockstep && !simulated && !simulated_time; }
};

/// A robot in lockstep waits for the command of this step.
struct RobotStep {
  std::int64_t step = 0;
  SensorTime stamp{};
};

/// Something to be shown to whoever drives.
struct RobotLog {
  std::string text{};
};

using RobotMessage = std::variant<RobotHello, RobotStep, RobotLog, Sample>;

class MessageFields;

/// Turns the lines of a robot into messages. Strict: a line that is not understood is an error that names the
/// line and the key, because a robot that is half understood must not be driven. Keys and types that are not
/// known are passed over, and said once.
class RobotMessageReader {
 public:
  /// `name`: what errors call the robot; `cameras`: the names of those it has, empty: any.
  explicit RobotMessageReader(std::string name, std::vector<std::string> cameras = {})
      : name_(std::move(name)), cameras_(std::move(cameras)) {}

  /// Nothing for an empty line and for an unknown type. Pictures are read and decoded; one that cannot be is
  /// left out, counted, and named among the warnings; so is what an unknown camera saw.
  [[nodiscard]] Result<std::optional<RobotMessage>> read(const Line& line);
  /// What was passed over, in words, since the last call.
  [[nodiscard]] std::vector<std::string> take_warnings() { return std::exchange(warnings_, {}); }

 private:
  friend class MessageFields;
  void warn_once(const std::string& words);
  void warn_of_left_out(std::int64_t line, const MessageFields& fields);

  std::string name_;
  std::vector<std::string> cameras_;
  std::set<std::string> said_{};
  std::vector<std::string> warnings_{};
  bool greeted_ = false;
  unsigned unreadable_pictures_ = 0;
  unsigned unknown_cameras_ = 0;                ///< lines of
  std::map<std::string, SensorTime> newest_{};  ///< by type, and camera
};

/// The line of a message, with its end. Of a picture the caller gives the bytes of a JPEG or PNG file; a
/// sample that has no line (ranges, commands) gives nothing.
[[nodiscard]] std::string to_line(const RobotMessage& message, const std::vector<std::uint8_t>& picture = {});

/// What a robot is told, as its process reads it.
struct RobotOrderLine {
  enum class Kind : std::uint8_t { Hello, Velocity, Bye, Other };
  Kind kind = Kind::Other;
  VelocityCommand command{};
  std::int64_t step = 0;
  bool by_watchdog = false;
  bool listen_only = false;  ///< of a hello: no velocity will come, somebody else drives
};
[[nodiscard]] RobotOrderLine parse_order_line(const std::string& text);

}  // namespace waymark

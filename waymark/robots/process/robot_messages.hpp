#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <nlohmann/json_fwd.hpp>

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

/// The keys of one line, taken one after the other; the first mistake is kept, and everything after it is
/// zero.
class MessageFields {
 public:
  MessageFields(RobotMessageReader& reader, const nlohmann::json& object, std::string type,
                std::int64_t line);

  [[nodiscard]] double number(const char* key, double least, double most);
  [[nodiscard]] double number_or(const char* key, double least, double most, double otherwise);
  [[nodiscard]] std::int64_t integer(const char* key, std::int64_t least, std::int64_t most);
  [[nodiscard]] std::string text(const char* key, bool needed = true);
  [[nodiscard]] bool flag_or_false(const char* key);
  /// stamp_s or stamp_ns; no stream goes back. Each camera is a stream of its own.
  [[nodiscard]] SensorTime stamp(const std::string& camera = {});
  /// The camera of a line: where none is named, the only one. What cannot be told, and a name that the robot
  /// does not have, leaves the line out.
  [[nodiscard]] std::string camera();
  /// Numbers; null is not a number, where `holes` are allowed.
  [[nodiscard]] std::vector<double> numbers(const char* key, std::size_t most, bool holes = false);
  [[nodiscard]] const nlohmann::json* array(const char* key, std::size_t most);
  [[nodiscard]] bool has(const char* key);

  void wrong(const std::string& key, const std::string& words, const std::string& hint = {});
  /// The line is understood, what it brings cannot be used: it is said, counted and left out.
  void leave_out(std::string words) { left_out_ = std::move(words); }
  [[nodiscard]] bool of_unknown_camera() const { return unknown_camera_; }
  [[nodiscard]] const std::string& left_out() const { return left_out_; }
  /// Says the keys that nobody took; the first mistake, if there was one.
  [[nodiscard]] Status finish();

 private:
  [[nodiscard]] const nlohmann::json* find(const char* key, bool needed);
  [[nodiscard]] double checked(const nlohmann::json& value, const char* key, double least, double most);

  RobotMessageReader& reader_;
  const nlohmann::json& object_;
  std::string type_;
  std::int64_t line_;
  std::set<std::string> taken_{"type"};
  Status status_{};
  std::string left_out_{};
  bool unknown_camera_ = false;
};

/// A tag of a line `detections`. What is wrong with it is said to the fields.
[[nodiscard]] TagDetection detection_of(MessageFields& fields, const nlohmann::json& tag);
/// A tag of a line `tag_poses`; likewise.
[[nodiscard]] SeenTagPose tag_pose_of(MessageFields& fields, const nlohmann::json& tag);

}  // namespace waymark

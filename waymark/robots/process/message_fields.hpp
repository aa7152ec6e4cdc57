#pragma once

#include <array>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/base/error.hpp"
#include "waymark/robots/process/robot_messages.hpp"

namespace waymark {

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

}  // namespace waymark

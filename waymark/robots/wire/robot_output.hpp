#pragma once

#include <set>
#include <string>
#include <vector>

#include "waymark/robots/process/robot_messages.hpp"
#include "waymark/robots/process/robot_wire.hpp"

namespace waymark {

/// Output of a robot process (docs/formats/robot-process.md): lines, and messages for the user. Messages
/// before the hello go to `wire.note`; later ones become log lines.
class RobotOutput {
 public:
  /// `wire` must outlive this object.
  explicit RobotOutput(const RobotWire& wire) : wire_(wire) {}

  /// Writes the hello, which is the first line.
  void greet(const RobotHello& hello);
  void write(const std::vector<std::string>& lines);
  void report(const std::string& text);
  /// Reports the text unless it has already been reported.
  void report_once(const std::string& text);
  [[nodiscard]] bool greeted() const { return greeted_; }
  /// Whether the output still has a reader.
  [[nodiscard]] bool open() const { return open_; }

 private:
  const RobotWire& wire_;
  bool greeted_ = false;
  bool open_ = true;
  std::set<std::string> reported_{};
};

}  // namespace waymark

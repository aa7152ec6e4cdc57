#pragma once

#include <set>
#include <string>
#include <vector>

#include "waymark/robots/process/robot_messages.hpp"
#include "waymark/robots/process/robot_wire.hpp"

namespace waymark {

/// What a robot process says (docs/formats/robot-process.md): lines, and words for people, which before the
/// hello go where `wire.say` takes them.
class RobotTalk {
 public:
  /// `wire` outlives this.
  explicit RobotTalk(const RobotWire& wire) : wire_(wire) {}

  /// The first line.
  void greet(const RobotHello& hello);
  void write(const std::vector<std::string>& lines);
  void say(const std::string& words);
  /// The same, but for what was said so already.
  void say_once(const std::string& words);
  [[nodiscard]] bool greeted() const { return greeted_; }
  /// Somebody still reads.
  [[nodiscard]] bool open() const { return open_; }

 private:
  const RobotWire& wire_;
  bool greeted_ = false;
  bool open_ = true;
  std::set<std::string> said_{};
};

}  // namespace waymark

#include "waymark/robots/wire/robot_output.hpp"

namespace waymark {

void RobotOutput::greet(const RobotHello& hello) {
  write({to_line(hello)});
  greeted_ = true;
}

void RobotOutput::write(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) open_ = open_ && wire_.write(line);
}

void RobotOutput::report(const std::string& text) {
  if (greeted_)
    write({to_line(RobotLog{text})});
  else
    wire_.note(text);
}

void RobotOutput::report_once(const std::string& text) {
  if (reported_.insert(text).second) report(text);
}

}  // namespace waymark

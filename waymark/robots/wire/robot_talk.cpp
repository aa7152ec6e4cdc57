#include "waymark/robots/wire/robot_talk.hpp"

namespace waymark {

void RobotTalk::greet(const RobotHello& hello) {
  write({to_line(hello)});
  greeted_ = true;
}

void RobotTalk::write(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) open_ = open_ && wire_.write(line);
}

void RobotTalk::say(const std::string& words) {
  if (greeted_)
    write({to_line(RobotLog{words})});
  else
    wire_.say(words);
}

void RobotTalk::say_once(const std::string& words) {
  if (said_.insert(words).second) say(words);
}

}  // namespace waymark

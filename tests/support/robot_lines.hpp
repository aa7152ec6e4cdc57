#pragma once

#include <string>
#include <variant>

#include <gtest/gtest.h>

#include "waymark/robots/process/robot_messages.hpp"

namespace waymark::test {

/// Parses the lines of a robot process like the program at the other end of the pipe, after a hello.
class RobotLines {
 public:
  Sample read(const std::string& line) {
    if (!greeted_) (void)reader_.read({.number = 1, .text = to_line(RobotHello{.name = "limo"})});
    greeted_ = true;
    const auto message = reader_.read({.number = 2, .text = line});
    EXPECT_TRUE(message) << line.substr(0, 100);
    return message && *message ? std::get<Sample>(**message) : Sample();
  }

 private:
  RobotMessageReader reader_{"test"};
  bool greeted_ = false;
};

/// The reports of a bridge since the last call, as one text.
template <class Bridge>
std::string reports_of(Bridge& bridge) {
  std::string all;
  for (const std::string& line : bridge.take_reports()) all += line;
  return all;
}

}  // namespace waymark::test

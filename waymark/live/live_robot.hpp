#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "waymark/drivers/process/process_robot.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// Where the words of a drive go.
struct LiveWords {
  std::function<void(const std::string&)> say = [](const std::string&) {};       ///< a sentence
  std::function<void(const std::string&)> progress = [](const std::string&) {};  ///< how far it is, in a line
  std::function<bool()> should_stop = [] { return false; };  ///< asked while the robot is awaited
};

/// A robot that is a process, what finds the tags in its pictures, and the loop between samples and commands.
class LiveRobot {
 public:
  /// Starts `command` and waits until it greets, or the words' should_stop says so. `cameras`: those it has.
  static Result<std::unique_ptr<LiveRobot>> open(const RobotCommand& command,
                                                 std::vector<MountedCamera> cameras, LiveWords words);

  /// RobotLoop::drive(); the words of the robot are said.
  Result<RobotLoopEnd> drive(RobotListener listener);

 private:
  LiveRobot(std::unique_ptr<ProcessRobot> robot, TagFinder finder, std::vector<MountedCamera> cameras,
            LiveWords words);

  std::unique_ptr<ProcessRobot> robot_;
  TagFinder finder_;
  RobotLoop loop_;
  LiveWords words_;
};

}  // namespace waymark

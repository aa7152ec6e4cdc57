#pragma once

#include <functional>
#include <memory>
#include <string>

#include "waymark/camera/camera_model.hpp"
#include "waymark/drivers/process/process_robot.hpp"
#include "waymark/runtime/robot_loop.hpp"

namespace waymark {

/// Where the words of a drive go.
struct LiveWords {
  std::function<void(const std::string&)> say = [](const std::string&) {};       ///< a sentence
  std::function<void(const std::string&)> progress = [](const std::string&) {};  ///< how far it is, in a line
};

/// A robot that is a process, the detector behind its camera, and the loop between samples and commands.
class LiveRobot {
 public:
  /// Starts `command` and waits until it greets. `camera`: for the corners of the tags in its pictures.
  static Result<std::unique_ptr<LiveRobot>> open(const RobotCommand& command, const CameraModel& camera,
                                                 LiveWords words);

  /// RobotLoop::drive(); the words of the robot are said.
  Result<RobotLoopEnd> drive(RobotListener listener);

 private:
  LiveRobot(std::unique_ptr<ProcessRobot> robot, std::unique_ptr<Detector> finder, LiveWords words);

  std::unique_ptr<ProcessRobot> robot_;
  std::unique_ptr<Detector> finder_;
  RobotLoop loop_;
  LiveWords words_;
};

}  // namespace waymark

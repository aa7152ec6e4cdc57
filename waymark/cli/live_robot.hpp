#pragma once

#include <memory>
#include <string>

#include "waymark/camera/camera_model.hpp"
#include "waymark/cli/console.hpp"
#include "waymark/drivers/process/process_robot.hpp"
#include "waymark/runtime/robot_loop.hpp"

namespace waymark::cli {

/// A robot that is a process, the detector behind its camera, and the loop between samples and commands.
class LiveRobot {
 public:
  /// Starts `command` and waits until it greets. `camera`: for the corners of the tags in its pictures.
  static Result<std::unique_ptr<LiveRobot>> open(const RobotCommand& command, const CameraModel& camera,
                                                 Console& console);

  /// RobotLoop::drive(); Ctrl-C ends it, and what the robot says to people is shown.
  Result<RobotLoopEnd> drive(RobotListener listener);

 private:
  LiveRobot(std::unique_ptr<ProcessRobot> robot, std::unique_ptr<Detector> finder, Console& console);

  std::unique_ptr<ProcessRobot> robot_;
  std::unique_ptr<Detector> finder_;
  RobotLoop loop_;
  Console& console_;
};

}  // namespace waymark::cli

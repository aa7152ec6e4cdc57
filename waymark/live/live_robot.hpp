#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "waymark/drivers/process/process_robot.hpp"
#include "waymark/jobs/job_control.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// A robot that is a process, what finds the tags in its pictures, and the loop between samples and commands.
class LiveRobot {
 public:
  /// Starts `command` and waits until it greets, or the control cancels. `cameras`: those it has.
  static Result<std::unique_ptr<LiveRobot>> open(const RobotCommand& command,
                                                 std::vector<MountedCamera> cameras, JobControl control);

  /// RobotLoop::drive(); the words of the robot are notes.
  Result<RobotLoopEnd> drive(RobotListener listener);

 private:
  LiveRobot(std::unique_ptr<ProcessRobot> robot, TagFinder finder, std::vector<MountedCamera> cameras,
            JobControl control);

  std::unique_ptr<ProcessRobot> robot_;
  TagFinder finder_;
  RobotLoop loop_;
  JobControl control_;
};

}  // namespace waymark

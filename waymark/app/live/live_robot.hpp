#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/live/robot_with_cameras.hpp"
#include "waymark/robots/process/process_robot.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// A robot that is a process, what finds the tags in its pictures, and the loop between samples and commands.
class LiveRobot {
 public:
  /// Starts the robot of the setup and waits until it greets, or the control cancels; opens the
  /// cameras of this computer that belong to it. That it is limited is a note.
  static Result<std::unique_ptr<LiveRobot>> open(const RobotSetup& setup, JobControl control);
  /// The same for a first drive: nothing is said of a limit, which holds all the same.
  static Result<std::unique_ptr<LiveRobot>> open_first(const RobotSetup& setup, JobControl control);

  /// RobotLoop::drive(); the words of the robot are notes. What is decided is slowed to speed_limit_m_s().
  Result<RobotLoopEnd> drive(RobotListener listener);
  /// Of a real robot that has not been commissioned (commission_limit.hpp); else infinity.
  [[nodiscard]] double speed_limit_m_s() const;
  /// The robot itself, where nothing is to be decided.
  [[nodiscard]] ProcessRobot& process() { return *robot_; }

 private:
  LiveRobot(std::unique_ptr<ProcessRobot> robot, std::unique_ptr<RobotWithCameras> source, TagFinder finder,
            std::vector<MountedCamera> cameras, bool listen_only, JobControl control);

  std::unique_ptr<ProcessRobot> robot_;
  std::unique_ptr<RobotWithCameras> source_;
  TagFinder finder_;
  RobotLoop loop_;
  JobControl control_;
  MotionLimits limits_{};                 ///< of the robot's file
  std::optional<std::string> limited_{};  ///< to a speed, and why
};

}  // namespace waymark

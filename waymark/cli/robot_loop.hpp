#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "waymark/camera/camera_model.hpp"
#include "waymark/cli/console.hpp"
#include "waymark/cli/tag_finder.hpp"
#include "waymark/drivers/process/process_robot.hpp"

namespace waymark::cli {

/// What becomes of a robot that is driven.
struct RobotListener {
  /// Every sample, in the order in which they came; tags right after the picture they were found in. The
  /// commands that were sent are among them.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Asked for a command twenty times a second and right after each picture; nothing ends the drive.
  std::function<Result<std::optional<VelocityCommand>>(Duration uptime, SensorTime now)> decide;
};

struct RobotLoopEnd {
  bool interrupted = false;  ///< by Ctrl-C
  double seconds = 0;        ///< by the robot's clock
};

/// A robot that lives: its process, the detector behind its camera, and the loop between samples and
/// commands. However the loop ends, the last command is zero; the watchdog sees to it where we cannot.
class RobotLoop {
 public:
  /// `camera`: for the corners of the tags in its pictures.
  static Result<std::unique_ptr<RobotLoop>> open(const std::string& command, const CameraModel& camera,
                                                 Console& console);

  /// Drives until `decide` gives nothing, Ctrl-C, or an error: a line that is not understood, a robot whose
  /// process ended, whatever the listener fails on.
  Result<RobotLoopEnd> drive(const RobotListener& listener);
  [[nodiscard]] const RobotHello& hello() const { return robot_->hello(); }
  /// Pictures that came faster than they could be looked at, and were not.
  [[nodiscard]] int dropped_pictures() const { return dropped_; }

 private:
  RobotLoop(std::unique_ptr<ProcessRobot> robot, TagFinder finder, CameraModel camera, Console& console)
      : robot_(std::move(robot)), finder_(std::move(finder)), camera_(camera), console_(console) {}
  Status hear(RobotMessage message, const RobotListener& listener);
  Status look(const RobotListener& listener);
  Status send(const VelocityCommand& command, SensorTime now, const RobotListener& listener);
  [[nodiscard]] Duration until_tick() const;
  Result<bool> tick(const RobotListener& listener);

  std::unique_ptr<ProcessRobot> robot_;
  TagFinder finder_;
  CameraModel camera_;
  Console& console_;
  std::optional<CameraFrame> unseen_{};
  bool due_ = false;
  Duration next_tick_{};
  Duration start_{};
  std::optional<SensorTime> first_{};
  VelocityCommand last_{};
  int dropped_ = 0;
};

}  // namespace waymark::cli

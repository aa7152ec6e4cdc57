#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/robots/process/process_robot.hpp"
#include "waymark/robots/process/robot_messages.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/samples/live_camera.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/tags/tag_finder.hpp"

/// A robot that is a process of its own.
namespace waymark {

/// Until its first drive (`waymark commission`) has passed, a real robot is driven no faster than this.
inline constexpr double kUncommissionedSpeed_m_s = 0.15;

/// Why a robot is limited to kUncommissionedSpeed_m_s, and the command that lifts it, in a sentence; nothing
/// for a robot that is simulated, and for one whose file holds a commission that passed and still counts.
[[nodiscard]] std::optional<std::string> lacks_commission(const RobotSetup& setup, const RobotHello& hello);

/// The command on the same arc, no faster than this, and within the robot's speed and yaw rate: nobody who
/// drives it, and no program, can ask for more.
[[nodiscard]] VelocityCommand slowed(const VelocityCommand& command, double most_m_s,
                                     const MotionLimits& limits);

/// A robot whose pictures come from cameras of this computer: its samples and theirs as one source. Stamps of
/// pictures are moved to the robot's clock, by what that shows when the picture arrives; pictures that come
/// before the robot's first sample are left out, and those that waited for more than a second while this
/// computer was busy: what the robot did since then was already heard. What the robot's own detector saw with
/// a camera that gives pictures here (tags with their corners or as poses) is left out, too: the pictures say
/// more.
class RobotWithCameras final : public Source {
 public:
  /// The robot outlives this; `names` of the cameras.
  RobotWithCameras(Source& robot, std::vector<std::unique_ptr<LiveCamera>> cameras,
                   std::set<std::string> names)
      : robot_(robot), cameras_(std::move(cameras)), names_(std::move(names)) {}

  /// Fails when the robot or a camera does.
  Result<std::optional<RobotEvent>> next(Duration most) override;
  [[nodiscard]] bool more() const override;
  [[nodiscard]] std::optional<SensorTime> now() const override { return robot_.now(); }

 private:
  [[nodiscard]] Result<std::optional<RobotEvent>> of_cameras();
  [[nodiscard]] Result<std::optional<RobotEvent>> hear_robot(Duration most);
  [[nodiscard]] bool move_to_robots_clock(CameraFrame& frame);
  [[nodiscard]] bool replaced(const RobotEvent& event) const;

  Source& robot_;
  std::vector<std::unique_ptr<LiveCamera>> cameras_;
  std::set<std::string> names_;
  std::size_t turn_ = 0;                      ///< of the camera that is asked first
  std::map<std::string, SensorTime> newest_;  ///< by camera
};

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
  /// Of a real robot that has not been commissioned (lacks_commission()); else infinity.
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

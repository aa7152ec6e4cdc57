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

/// Drives a robot process.
namespace waymark {

/// Speed limit for a real robot until it has passed its first drive (`waymark commission`).
inline constexpr double kUncommissionedSpeed_m_s = 0.15;

/// Explains in one sentence why a robot is limited to kUncommissionedSpeed_m_s, and names the command that
/// lifts the limit. `nullopt` for a simulated robot, and if the robot file contains a successful commission
/// that is still valid.
[[nodiscard]] std::optional<std::string> lacks_commission(const RobotSetup& setup, const RobotHello& hello);

/// Scales the command along the same arc so that the speed is at most `max_speed_m_s`, and the speed and yaw
/// rate are within the limits of the robot. Applies to commands from any driver.
[[nodiscard]] VelocityCommand slowed(const VelocityCommand& command, double max_speed_m_s,
                                     const MotionLimits& limits);

/// Combines a robot and cameras on this computer into one source of samples. Image timestamps are converted
/// to the robot's clock when the image arrives. Images taken before the robot's first sample are skipped.
/// Images that waited for more than a second while this computer was busy are also skipped, because later
/// robot samples have already been processed. If the robot's own detector reports tags (corners or poses) for
/// one of these cameras, they are skipped too, because the images contain more information.
class RobotWithCameras final : public Source {
 public:
  /// The robot must outlive this object; `names` are the names of the cameras.
  RobotWithCameras(Source& robot, std::vector<std::unique_ptr<LiveCamera>> cameras,
                   std::set<std::string> names)
      : robot_(robot), cameras_(std::move(cameras)), names_(std::move(names)) {}

  /// Fails if the robot or a camera fails.
  Result<std::optional<RobotEvent>> next(Duration most) override;
  [[nodiscard]] bool more() const override;
  [[nodiscard]] std::optional<SensorTime> now() const override { return robot_.now(); }

 private:
  [[nodiscard]] Result<std::optional<RobotEvent>> next_of_cameras();
  [[nodiscard]] Result<std::optional<RobotEvent>> receive_from_robot(Duration most);
  [[nodiscard]] bool move_to_robots_clock(CameraFrame& frame);
  [[nodiscard]] bool replaced(const RobotEvent& event) const;

  Source& robot_;
  std::vector<std::unique_ptr<LiveCamera>> cameras_;
  std::set<std::string> names_;
  std::size_t turn_ = 0;                      ///< index of the camera that is polled first
  std::map<std::string, SensorTime> newest_;  ///< newest timestamp of each camera
};

/// A robot process, a detector for its images, and the loop that turns samples into commands.
class LiveRobot {
 public:
  /// Starts the robot of the setup, waits for its hello message (or until the control cancels), and opens the
  /// cameras on this computer. If the speed is limited, prints a note.
  static Result<std::unique_ptr<LiveRobot>> open(const RobotSetup& setup, JobControl control);
  /// The same for a first drive, for which the speed limit applies without a note.
  static Result<std::unique_ptr<LiveRobot>> open_first(const RobotSetup& setup, JobControl control);

  /// Calls RobotLoop::drive() with commands limited to speed_limit_m_s(). Texts from the robot are printed as
  /// notes.
  Result<RobotLoopEnd> drive(RobotListener listener);
  /// The speed limit for a real robot that has not been commissioned (lacks_commission()); otherwise
  /// infinity.
  [[nodiscard]] double speed_limit_m_s() const;
  /// The robot process, for jobs that send no commands.
  [[nodiscard]] ProcessRobot& process() { return *robot_; }

 private:
  LiveRobot(std::unique_ptr<ProcessRobot> robot, std::unique_ptr<RobotWithCameras> source, TagFinder finder,
            std::vector<MountedCamera> cameras, bool listen_only, JobControl control);

  std::unique_ptr<ProcessRobot> robot_;
  std::unique_ptr<RobotWithCameras> source_;
  TagFinder finder_;
  RobotLoop loop_;
  JobControl control_;
  MotionLimits limits_{};                 ///< limits from the robot file
  std::optional<std::string> limited_{};  ///< why the speed is limited; empty if it is not
};

}  // namespace waymark

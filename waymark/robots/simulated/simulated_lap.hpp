#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/robots/simulated/detecting_camera.hpp"
#include "waymark/robots/simulated/simulated_robot.hpp"
#include "waymark/runtime/replay_session.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot.hpp"
#include "waymark/simulation/robot/scripted_driver.hpp"

namespace waymark {

/// The samples of a simulated robot, which asks for a command twenty times a second of its own time and waits
/// for it.
class SimulatedSource final : public Source {
 public:
  /// The robot outlives it. `scene_camera`: takes the pictures; without it CameraFrames have none, and
  /// SimulatedRobot::shot() says how to take the last one.
  explicit SimulatedSource(SimulatedRobot& robot, std::unique_ptr<DetectingCamera> scene_camera = nullptr)
      : robot_(robot), scene_camera_(std::move(scene_camera)) {}

  /// Never waits and never ends: the simulated world goes on.
  Result<std::optional<RobotEvent>> next(Duration most) override;
  [[nodiscard]] bool more() const override { return true; }
  [[nodiscard]] std::optional<SensorTime> now() const override { return robot_.now(); }

 private:
  SimulatedRobot& robot_;
  std::unique_ptr<DetectingCamera> scene_camera_;
  Duration next_request_{};
  bool asks_ = false;
};

/// The place, the robot in it, and how both behave.
struct SimulatedSetup {
  World world{};
  RobotModel model{};
  CameraModel camera;
  SimulatedRobotOptions robot{};  ///< its seed makes the lap
  std::optional<DetectingCameraOptions>
      pictures{};   ///< nothing: camera and detector in one, without pictures
  int threads = 1;  ///< that take pictures and look at them
  std::string camera_name = "cam";
  std::vector<MountedCamera> more_cameras{};  ///< beside the first: `camera`, mounted as `model` says

  /// All of them, the first one first.
  [[nodiscard]] std::vector<MountedCamera> cameras() const;
};

/// What becomes of a lap or a replay as it is driven. Everything is called in order of time.
struct LapListener {
  /// Every sample, the commands sent among them; an error ends the lap.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Every picture of a lap, before the frame of tags that was found in it. (Those of a replay are samples.)
  std::function<Status(const SeenPicture&)> on_picture = [](const SeenPicture&) { return Status(); };
  /// Every decision of a replay, before its command is sent.
  std::function<Status(SensorTime, const ReplayStep&)> on_step = [](SensorTime, const ReplayStep&) {
    return Status();
  };
  /// Whether to stop the robot and end the lap now (Ctrl-C).
  std::function<bool()> should_stop = [] { return false; };
};

/// Asked twenty times a second: the true pose (a person sees the robot), the time since it was switched on,
/// and the time of its sensors. An error ends the lap.
using DriveFunction =
    std::function<Result<DriverDecision>(const SE2& map_T_base, Duration uptime, SensorTime now)>;

/// Lets somebody drive the robot, from the beginning of the world's line. What the listener receives, and the
/// order of it, does not depend on the number of threads.
[[nodiscard]] Result<LapEnd> drive_lap(const SimulatedSetup& setup, const DriveFunction& drive,
                                       const LapListener& listener, double timeout_s = 600);

/// The scripted driver of a setup, on the world's line. Fails on a world without one.
[[nodiscard]] Result<ScriptedDriver> scripted_driver(const SimulatedSetup& setup,
                                                     const DriverOptions& driver);

/// Drives the world's line once, as a person would who knows the place: the robot starts on the line and
/// stands at the end. Gives up after `timeout_s` of simulated time. Fails on a world without a line and on
/// what the listener fails on.
[[nodiscard]] Result<LapEnd> drive_scripted_lap(const SimulatedSetup& setup, const DriverOptions& driver,
                                                const LapListener& listener, double timeout_s = 600);

struct SimulatedReplayOptions {
  double timeout_s = 600;
  double give_up_s = 5;  ///< ReplaySessionOptions
};

/// Lets a replayer drive a robot that starts at the beginning of the world's line, as a ReplaySession.
[[nodiscard]] Result<ReplayEnd> drive_replay(const SimulatedSetup& setup, Replayer& replayer,
                                             const LapListener& listener,
                                             const SimulatedReplayOptions& options = {});

}  // namespace waymark

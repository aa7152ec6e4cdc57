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

/// The samples of a simulated robot, which requests a command twenty times per second of its own time and
/// waits for it.
class SimulatedSource final : public Source {
 public:
  /// `robot` must outlive this object. `scene_camera` renders the images; without it, CameraFrames are empty,
  /// and SimulatedRobot::shot() describes the last one.
  explicit SimulatedSource(SimulatedRobot& robot, std::unique_ptr<DetectingCamera> scene_camera = nullptr)
      : robot_(robot), scene_camera_(std::move(scene_camera)) {}

  /// Never blocks and never ends, because the simulation continues without limit.
  Result<std::optional<RobotEvent>> next(Duration timeout) override;
  [[nodiscard]] bool more() const override { return true; }
  [[nodiscard]] std::optional<SensorTime> now() const override { return robot_.now(); }

 private:
  SimulatedRobot& robot_;
  std::unique_ptr<DetectingCamera> scene_camera_;
  Duration next_request_{};
  bool requests_command_ = false;
};

/// World, robot, cameras and options for a simulation.
struct SimulatedSetup {
  World world{};
  RobotModel model{};
  CameraModel camera;
  SimulatedRobotOptions robot{};  ///< its seed determines the lap
  std::optional<DetectingCameraOptions>
      images{};     ///< if empty, corners are simulated directly, without images
  int threads = 1;  ///< number of threads for rendering and detection
  std::string camera_name = "cam";
  std::vector<MountedCamera> more_cameras{};  ///< additional to `camera`, whose mounting is part of `model`

  /// All cameras, starting with `camera`.
  [[nodiscard]] std::vector<MountedCamera> cameras() const;
};

/// Callbacks during a lap or a replay, called in chronological order.
struct LapListener {
  /// Called for every sample, including the commands sent; an error ends the lap.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Called for every image in a lap, before the TagFrame with its detections. (In a replay, images are
  /// samples.)
  std::function<Status(const SeenImage&)> on_image = [](const SeenImage&) { return Status(); };
  /// Called for every decision in a replay, before its command is sent.
  std::function<Status(SensorTime, const ReplayStep&)> on_step = [](SensorTime, const ReplayStep&) {
    return Status();
  };
  /// Whether to stop the robot and end the lap now (Ctrl-C).
  std::function<bool()> should_stop = [] { return false; };
};

/// A driver, called twenty times a second with the true pose (as a person would see it), the time since the
/// start, and the time of the sensors. An error ends the lap.
using DriveFunction =
    std::function<Result<DriverDecision>(const SE2& map_T_base, Duration uptime, SensorTime now)>;

/// Drives the robot with the driver `drive`, starting at the beginning of the world's line. The calls to the
/// listener and their order do not depend on the number of threads.
[[nodiscard]] Result<LapEnd> drive_lap(const SimulatedSetup& setup, const DriveFunction& drive,
                                       const LapListener& listener, double timeout_s = 600);

/// The scripted driver for a setup, which follows the world's line. Fails if the world has no line.
[[nodiscard]] Result<ScriptedDriver> scripted_driver(const SimulatedSetup& setup,
                                                     const DriverOptions& driver);

/// Drives the world's line once with the scripted driver: the robot starts at the beginning of the line and
/// stops at its end. Gives up after `timeout_s` of simulated time. Fails if the world has no line or the
/// listener fails.
[[nodiscard]] Result<LapEnd> drive_scripted_lap(const SimulatedSetup& setup, const DriverOptions& driver,
                                                const LapListener& listener, double timeout_s = 600);

struct SimulatedReplayOptions {
  double timeout_s = 600;
  double give_up_s = 5;  ///< as in ReplaySessionOptions
};

/// Runs a ReplaySession with a robot that starts at the beginning of the world's line.
[[nodiscard]] Result<ReplayEnd> drive_replay(const SimulatedSetup& setup, Replayer& replayer,
                                             const LapListener& listener,
                                             const SimulatedReplayOptions& options = {});

}  // namespace waymark

#pragma once

#include <functional>
#include <optional>
#include <string>

#include "waymark/drivers/simulated/scene_eye.hpp"
#include "waymark/drivers/simulated/simulated_robot.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/simulation/scripted_driver.hpp"

namespace waymark {

/// The place, the robot in it, and how both behave.
struct SimulatedStage {
  World world{};
  RobotModel model{};
  CameraModel camera;
  SimulatedRobotOptions robot{};              ///< its seed makes the lap
  std::optional<SceneEyeOptions> pictures{};  ///< nothing: camera and detector in one, without pictures
  int threads = 1;                            ///< that take pictures and look at them
};

/// What becomes of a lap as it is driven. Everything is called in order of time.
struct LapListener {
  /// Every sample, the commands sent among them; an error ends the lap.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Every picture, before the frame of tags that was found in it.
  std::function<Status(const SeenPicture&)> on_picture = [](const SeenPicture&) { return Status(); };
  /// Every decision of a replay, before its command is sent.
  std::function<Status(SensorTime, const ReplayStep&)> on_step = [](SensorTime, const ReplayStep&) {
    return Status();
  };
  /// Whether to stop the robot and end the lap now (Ctrl-C).
  std::function<bool()> should_stop = [] { return false; };
};

struct SimulatedLapEnd {
  bool finished = false;     ///< the driver was done, or the replay at its goal
  bool interrupted = false;  ///< should_stop() said so
  double lap_s = 0;          ///< simulated time
};

/// What a driver decides.
struct DriverDecision {
  VelocityCommand command{};
  bool done = false;                  ///< the lap is over; the command is then the last one
  std::optional<GamepadState> pad{};  ///< what the driver held in hand; recorded
};
/// Asked twenty times a second: the true pose (a person sees the robot), the time since it was switched on,
/// and the time of its sensors. An error ends the lap.
using Drive = std::function<Result<DriverDecision>(const SE2& map_T_base, Duration uptime, SensorTime now)>;

/// Lets somebody drive the robot, from the beginning of the world's line. What the listener hears, and the
/// order of it, does not depend on the number of threads.
[[nodiscard]] Result<SimulatedLapEnd> drive_lap(const SimulatedStage& stage, const Drive& drive,
                                                const LapListener& listener, double timeout_s = 600);

/// Drives the world's line once, as a person would who knows the place: the robot starts on the line and
/// stands at the end. Gives up after `timeout_s` of simulated time. Fails on a world without a line and on
/// what the listener fails on.
[[nodiscard]] Result<SimulatedLapEnd> drive_scripted_lap(const SimulatedStage& stage,
                                                         const DriverOptions& driver,
                                                         const LapListener& listener, double timeout_s = 600);

struct SimulatedReplayEnd : SimulatedLapEnd {
  ReplayState state = ReplayState::Waiting;  ///< the last one
  std::string reason{};                      ///< of a refusal, or of the stop that was not overcome
  int stops = 0;
  int frames = 0;
  int frames_with_two_tags = 0;
};

struct SimulatedReplayOptions {
  double timeout_s = 600;
  double give_up_s = 5;  ///< a robot that waits or stands stopped for so long is given up
};

/// Lets a replayer drive a robot that starts at the beginning of the world's line. Ends when it is at its
/// goal, refuses, or stands for too long. With pictures one thread takes them, in time.
[[nodiscard]] Result<SimulatedReplayEnd> drive_replay(const SimulatedStage& stage, Replayer& replayer,
                                                      const LapListener& listener,
                                                      const SimulatedReplayOptions& options = {});

}  // namespace waymark

#pragma once

#include <functional>
#include <string>

#include "waymark/drivers/simulated/simulated_robot.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/simulation/scripted_driver.hpp"

namespace waymark {

/// The place, the robot in it, and how both behave.
struct SimulatedStage {
  World world{};
  RobotModel model{};
  CameraModel camera;
  SimulatedRobotOptions robot{};  ///< its seed makes the lap
};

/// What becomes of a lap as it is driven. Everything is called in order of time.
struct LapListener {
  /// Every sample, the commands sent among them; an error ends the lap.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
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
/// goal, refuses, or stands for too long.
[[nodiscard]] Result<SimulatedReplayEnd> drive_replay(const SimulatedStage& stage, Replayer& replayer,
                                                      const LapListener& listener,
                                                      const SimulatedReplayOptions& options = {});

}  // namespace waymark

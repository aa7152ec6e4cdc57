#include "waymark/robots/simulated/simulated_lap.hpp"

#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/robots/simulated/sample_line.hpp"
#include "waymark/robots/simulated/simulated_source.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

constexpr double kPathStepMetres = 0.02;
/// The driver's hand must not shake in step with the sensors' noise.
constexpr std::uint64_t kDriverSeed = 1000;

Result<std::vector<PathPoint>> line_of(const World& world) {
  std::vector<PathPoint> path = sample_path(world.path_m, world.path_closed, kPathStepMetres);
  if (path.size() < 3)
    return fail(ErrorCode::InvalidArgument, "the world has no line to drive", {.source = world.name},
                "Give path_m three distinct points or more.");
  return path;
}

SimulatedRobot robot_at_start(const SimulatedSetup& setup, const std::vector<PathPoint>& path) {
  return {setup.world,     setup.model,
          setup.cameras(), path.front().map_T_path,
          setup.robot,     setup.pictures ? CameraOutput::Shots : CameraOutput::Corners};
}

/// The loop of a robot whose time stands still while something is decided.
RobotLoop loop_of(SimulatedSource& source, SimulatedRobot& robot, PictureSearch search, double timeout_s) {
  return {source, robot, lockstep_time([&robot] { return robot.uptime(); }), std::move(search),
          RobotLoopOptions{.timeout_s = timeout_s}};
}

}  // namespace

std::vector<MountedCamera> SimulatedSetup::cameras() const {
  std::vector<MountedCamera> all = {{.name = camera_name, .camera = camera, .base_T_cam = model.base_T_cam}};
  all.insert(all.end(), more_cameras.begin(), more_cameras.end());
  return all;
}

Result<LapEnd> drive_lap(const SimulatedSetup& setup, const DriveFunction& drive, const LapListener& listener,
                         double timeout_s) {
  const Result<std::vector<PathPoint>> path = line_of(setup.world);
  if (!path) return tl::unexpected(path.error());
  const auto line = SampleLine::make(setup, listener);
  if (!line) return tl::unexpected(line.error());
  SimulatedRobot robot = robot_at_start(setup, *path);
  SimulatedSource source(robot);
  RobotListener driver;
  driver.on_sample = [&](const Sample& sample) { return (*line)->add(sample, robot.shot()); };
  driver.decide = [&](Duration uptime, SensorTime now) {
    return drive(robot.true_map_T_base(), uptime, now);
  };
  driver.should_stop = listener.should_stop;
  const auto driven = loop_of(source, robot, {}, timeout_s).drive(driver);
  if (!driven) return tl::unexpected(driven.error());
  if (Status status = (*line)->finish(); !status) return tl::unexpected(status.error());
  return LapEnd{
      .finished = driven->done, .interrupted = driven->interrupted, .lap_s = to_seconds(driven->uptime)};
}

Result<ScriptedDriver> scripted_driver(const SimulatedSetup& setup, const DriverOptions& driver) {
  const Result<std::vector<PathPoint>> path = line_of(setup.world);
  if (!path) return tl::unexpected(path.error());
  return ScriptedDriver(*path, setup.world.path_closed, driver, Random(setup.robot.seed + kDriverSeed));
}

Result<LapEnd> drive_scripted_lap(const SimulatedSetup& setup, const DriverOptions& options,
                                  const LapListener& listener, double timeout_s) {
  Result<ScriptedDriver> driver = scripted_driver(setup, options);
  if (!driver) return tl::unexpected(driver.error());
  return drive_lap(
      setup,
      [&](const SE2& map_T_base, Duration uptime, SensorTime) -> Result<DriverDecision> {
        const VelocityCommand command = driver->drive(map_T_base, SensorTime(uptime));
        return DriverDecision{.command = command, .done = driver->done()};
      },
      listener, timeout_s);
}

Result<ReplayEnd> drive_replay(const SimulatedSetup& setup, Replayer& replayer, const LapListener& listener,
                               const SimulatedReplayOptions& options) {
  const Result<std::vector<PathPoint>> path = line_of(setup.world);
  if (!path) return tl::unexpected(path.error());
  SimulatedRobot robot = robot_at_start(setup, *path);
  std::unique_ptr<DetectingCamera> scene_camera;
  if (setup.pictures) {
    auto made =
        DetectingCamera::make(std::make_shared<const World>(setup.world), setup.cameras(), *setup.pictures);
    if (!made) return tl::unexpected(made.error());
    scene_camera = std::move(*made);
  }
  const PictureSearch search{.finder = scene_camera ? &scene_camera->finder() : nullptr,
                             .cameras = setup.cameras()};
  SimulatedSource source(robot, std::move(scene_camera));
  ReplaySession session(replayer, {.on_sample = listener.on_sample, .on_step = listener.on_step},
                        {.give_up_s = options.give_up_s});
  RobotListener driver = session.listener();
  driver.should_stop = listener.should_stop;
  const auto driven = loop_of(source, robot, search, options.timeout_s).drive(driver);
  if (!driven) return tl::unexpected(driven.error());
  // Whatever the last decision was, the recording ends with a zero of its own.
  if (Status received = driven->done ? listener.on_sample(StampedCommand{robot.now(), {}}) : Status();
      !received)
    return tl::unexpected(received.error());
  ReplayEnd end = session.end(*driven);
  end.lap_s = to_seconds(driven->uptime);
  return end;
}

}  // namespace waymark

#include "waymark/drivers/simulated/simulated_lap.hpp"

#include <memory>
#include <variant>
#include <vector>

#include "waymark/drivers/simulated/sample_line.hpp"
#include "waymark/simulation/path.hpp"

namespace waymark {
namespace {

constexpr Duration kControlPeriod = std::chrono::milliseconds(50);
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

Status send(SimulatedRobot& robot, const VelocityCommand& command, SampleLine& line) {
  if (Status status = robot.command(command); !status) return status;
  return line.add(StampedCommand{robot.now(), command});
}

double seconds_of(const SimulatedRobot& robot) { return to_seconds(robot.uptime()); }

SimulatedRobot robot_at_start(const SimulatedStage& stage, const std::vector<PathPoint>& path) {
  return {stage.world,  stage.model,
          stage.camera, path.front().map_T_path,
          stage.robot,  stage.pictures ? Eye::Shots : Eye::Corners};
}

}  // namespace

Result<SimulatedLapEnd> drive_lap(const SimulatedStage& stage, const Drive& drive,
                                  const LapListener& listener, double timeout_s) {
  const Result<std::vector<PathPoint>> path = line_of(stage.world);
  if (!path) return tl::unexpected(path.error());
  const auto line = SampleLine::make(stage, listener);
  if (!line) return tl::unexpected(line.error());
  SimulatedRobot robot = robot_at_start(stage, *path);
  SimulatedLapEnd end;
  Duration next_command{};
  while (!end.finished && !end.interrupted && seconds_of(robot) < timeout_s) {
    Result<std::optional<Sample>> sample = robot.next();
    if (!sample) return tl::unexpected(sample.error());
    if (Status status = (*line)->add(std::move(**sample), robot.shot()); !status)
      return tl::unexpected(status.error());
    end.interrupted = listener.should_stop();
    if (robot.uptime() < next_command) continue;
    const Result<DriverDecision> decision = drive(robot.true_map_T_base(), robot.uptime(), robot.now());
    Status status = decision ? Status() : tl::unexpected(decision.error());
    if (status && decision->pad) status = (*line)->add(*decision->pad);
    if (status) status = send(robot, decision->command, **line);
    if (!status) return tl::unexpected(status.error());
    end.finished = decision->done;
    next_command += kControlPeriod;
  }
  if (!end.finished) {
    if (Status status = send(robot, {}, **line); !status) return tl::unexpected(status.error());
  }
  if (Status status = (*line)->finish(); !status) return tl::unexpected(status.error());
  end.lap_s = seconds_of(robot);
  return end;
}

Result<SimulatedLapEnd> drive_scripted_lap(const SimulatedStage& stage, const DriverOptions& options,
                                           const LapListener& listener, double timeout_s) {
  const Result<std::vector<PathPoint>> path = line_of(stage.world);
  if (!path) return tl::unexpected(path.error());
  ScriptedDriver driver(*path, stage.world.path_closed, options, Random(stage.robot.seed + kDriverSeed));
  return drive_lap(
      stage,
      [&](const SE2& map_T_base, Duration uptime, SensorTime) -> Result<DriverDecision> {
        const VelocityCommand command = driver.drive(map_T_base, SensorTime(uptime));
        return DriverDecision{.command = command, .done = driver.done()};
      },
      listener, timeout_s);
}

namespace {

/// A replay as it goes on.
class ReplayDrive {
 public:
  ReplayDrive(const SimulatedStage& stage, const std::vector<PathPoint>& path, Replayer& replayer,
              const LapListener& listener, const SimulatedReplayOptions& options)
      : stage_(stage),
        robot_(robot_at_start(stage, path)),
        replayer_(replayer),
        listener_(listener),
        options_(options) {
    stage_.threads = 1;  // the loop is closed: every picture is waited for
    ear_ = listener;
    ear_.on_sample = [this](const Sample& sample) { return hear(sample); };
  }

  Result<SimulatedReplayEnd> run() {
    auto line = SampleLine::make(stage_, ear_);
    if (!line) return tl::unexpected(line.error());
    line_ = std::move(*line);
    Duration next_command{};
    while (!over()) {
      Result<std::optional<Sample>> sample = robot_.next();
      if (!sample) return tl::unexpected(sample.error());
      if (Status status = line_->add(std::move(**sample), robot_.shot()); !status)
        return tl::unexpected(status.error());
      end_.interrupted = listener_.should_stop();
      if (robot_.uptime() < next_command) continue;
      next_command += kControlPeriod;
      if (Status status = step(); !status) return tl::unexpected(status.error());
    }
    if (Status status = send(robot_, {}, *line_); !status) return tl::unexpected(status.error());
    end_.finished = end_.state == ReplayState::Finished;
    end_.stops = replayer_.stops();
    end_.lap_s = seconds_of(robot_);
    return end_;
  }

 private:
  Status hear(const Sample& sample) {
    if (const auto* frame = std::get_if<TagFrame>(&sample)) {
      replayer_.add(*frame);
      ++end_.frames;
      end_.frames_with_two_tags += frame->detections.size() >= 2 ? 1 : 0;
    }
    if (const auto* odometry = std::get_if<Odometry>(&sample)) replayer_.add(*odometry);
    if (const auto* imu = std::get_if<ImuSample>(&sample)) replayer_.add(*imu);
    if (const auto* scan = std::get_if<LaserScan>(&sample)) replayer_.add(*scan);
    return listener_.on_sample(sample);
  }

  Status step() {
    const ReplayStep step = replayer_.step(robot_.now());
    end_.state = step.state;
    end_.reason = step.reason.value_or("");
    const bool goes_on = step.state == ReplayState::Driving || step.state == ReplayState::AtStation;
    if (goes_on) last_driving_ = robot_.uptime();
    if (Status status = listener_.on_step(robot_.now(), step); !status) return status;
    return send(robot_, step.command, *line_);
  }

  [[nodiscard]] bool over() const {
    return end_.interrupted || end_.state == ReplayState::Finished || end_.state == ReplayState::Refused ||
           seconds_of(robot_) >= options_.timeout_s ||
           to_seconds(robot_.uptime() - last_driving_) >= options_.give_up_s;
  }

  SimulatedStage stage_;
  SimulatedRobot robot_;
  Replayer& replayer_;
  const LapListener& listener_;
  LapListener ear_{};
  std::unique_ptr<SampleLine> line_{};
  SimulatedReplayOptions options_;
  SimulatedReplayEnd end_{};
  Duration last_driving_{};
};

}  // namespace

Result<SimulatedReplayEnd> drive_replay(const SimulatedStage& stage, Replayer& replayer,
                                        const LapListener& listener, const SimulatedReplayOptions& options) {
  const Result<std::vector<PathPoint>> path = line_of(stage.world);
  if (!path) return tl::unexpected(path.error());
  return ReplayDrive(stage, *path, replayer, listener, options).run();
}

}  // namespace waymark

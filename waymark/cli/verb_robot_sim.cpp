#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/App.hpp>

#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/picture_flags.hpp"
#include "waymark/cli/stage_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/drivers/process/robot_messages.hpp"
#include "waymark/drivers/simulated/simulated_robot.hpp"
#include "waymark/drivers/watchdog/pipes.hpp"
#include "waymark/simulation/path.hpp"

namespace waymark::cli {
namespace {

constexpr Duration kOrderPeriod = std::chrono::milliseconds(50);
constexpr int kPictureQuality = 92;

/// The orders on standard input.
class OrderInput {
 public:
  /// The newest order that came until now; waits up to `most` for one.
  std::optional<RobotOrderLine> newest(Duration most) {
    pollfd ready{STDIN_FILENO, POLLIN, 0};
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(most).count();
    std::optional<RobotOrderLine> found;
    while (!ended_ && poll(&ready, 1, found ? 0 : static_cast<int>(ms)) > 0) {
      std::string bytes;
      ended_ = read_some(STDIN_FILENO, bytes) == Moved::Ended;
      lines_.add(bytes);
      while (const auto line = lines_.next()) {
        const RobotOrderLine order = parse_order_line(line->text);
        ended_ = ended_ || order.kind == RobotOrderLine::Kind::Bye;
        if (order.kind == RobotOrderLine::Kind::Velocity) found = order;
        if (found && found->step == answer_to_ && answer_to_ != 0) return found;
      }
    }
    return found;
  }
  /// Only the answer to this step counts.
  void wait_for(std::int64_t step) { answer_to_ = step; }
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  LineSplitter lines_{};
  std::int64_t answer_to_ = 0;
  bool ended_ = false;
};

/// A simulated robot that speaks on standard output and listens on standard input.
class SpeakingRobot {
 public:
  SpeakingRobot(const SimulatedStage& stage, SE2 start, std::unique_ptr<SceneEye> eye, bool lockstep,
                double pace)
      : name_(stage.model.name),
        robot_(stage.world, stage.model, stage.camera, start, stage.robot,
               eye != nullptr ? Eye::Shots : Eye::Corners),
        eye_(std::move(eye)),
        lockstep_(lockstep),
        pace_(pace) {}

  Status run() {
    RobotHello hello{.name = name_, .lockstep = lockstep_};
    hello.sends = {"odometry", "wheels", "imu", "truth", eye_ != nullptr ? "image" : "detections"};
    Status status = say(to_line(hello));
    start_ = steady_now();
    Duration next_order{};
    while (status && !over()) {
      status = speak(robot_.next());
      if (!status || robot_.uptime() < next_order) continue;
      next_order += kOrderPeriod;
      status = lockstep_ ? obey_in_step() : obey_in_time();
    }
    return over() ? Status() : status;
  }

 private:
  [[nodiscard]] bool over() const { return orders_.ended() || reader_gone_ || interrupted(); }

  Status say(const std::string& line) {
    const bool written = std::fwrite(line.data(), 1, line.size(), stdout) == line.size();
    reader_gone_ = !written;
    return {};
  }

  Status speak(const Sample& sample) {
    if (!std::holds_alternative<CameraFrame>(sample)) return say(to_line(sample));
    const auto taken = eye_->take(robot_.shot());
    if (!taken) return tl::unexpected(taken.error());
    const auto jpeg = encode_jpeg(taken->image, kPictureQuality);
    if (!jpeg) return tl::unexpected(jpeg.error());
    return say(to_line(sample, *jpeg));
  }

  Status obey_in_step() {
    const std::int64_t step = ++step_;
    Status status = say(to_line(RobotStep{step, robot_.now()}));
    (void)std::fflush(stdout);
    if (pace_ > 0) keep_pace();
    orders_.wait_for(step);
    while (status && !over()) {
      const auto order = orders_.newest(std::chrono::milliseconds(100));
      if (order && order->step == step) return robot_.command(order->command);
    }
    return status;
  }

  /// What a busy host was late by is not made up for: nobody asked for a robot that hurries.
  void keep_pace() {
    const Duration due(static_cast<std::int64_t>(static_cast<double>(robot_.uptime().count()) / pace_));
    const Duration ahead = start_ + due - steady_now();
    if (ahead > Duration(0)) std::this_thread::sleep_for(ahead);
    if (ahead < -kOrderPeriod) start_ -= ahead + kOrderPeriod;
  }

  Status obey_in_time() {
    (void)std::fflush(stdout);
    const Duration ahead = start_ + robot_.uptime() - steady_now();
    if (ahead > Duration(0)) std::this_thread::sleep_for(ahead);
    const auto order = orders_.newest(Duration(0));
    return order ? robot_.command(order->command) : Status();
  }

  std::string name_;
  SimulatedRobot robot_;
  std::unique_ptr<SceneEye> eye_;
  bool lockstep_;
  double pace_;
  OrderInput orders_{};
  Duration start_{};
  std::int64_t step_ = 0;
  bool reader_gone_ = false;
};

struct RobotSimArgs {
  explicit RobotSimArgs(CLI::App& app) : stage(app), pictures(app) {}
  StageFlags stage;
  PictureFlags pictures;
  bool lockstep = false;
  double pace = 0;
};

ExitCode robot_sim(const RobotSimArgs& args, Console& console) {
  Result<Stage> stage = args.stage.make();
  Status status = stage ? args.pictures.apply(stage->simulated) : tl::unexpected(stage.error());
  if (!status) {
    console.say(status.error());
    return ExitCode::Usage;
  }
  const SimulatedStage& simulated = stage->simulated;
  constexpr double kStep_m = 0.02;
  const auto path = sample_path(simulated.world.path_m, simulated.world.path_closed, kStep_m);
  if (path.empty()) {
    console.say("the world has no line (path_m), so nobody knows where the robot starts");
    return ExitCode::Usage;
  }
  std::unique_ptr<SceneEye> eye;
  if (simulated.pictures) {
    auto made = SceneEye::make(std::make_shared<const World>(simulated.world), simulated.camera,
                               simulated.model.base_T_cam, *simulated.pictures);
    if (!made) {
      console.say(made.error());
      return ExitCode::SomeFailed;
    }
    eye = std::move(*made);
  }
  never_wait(STDIN_FILENO);
  status = SpeakingRobot(simulated, path.front().map_T_path, std::move(eye), args.lockstep, args.pace).run();
  if (status) return ExitCode::Ok;
  console.say(status.error());
  return ExitCode::SomeFailed;
}

Run prepare_robot_sim(CLI::App& app) {
  const auto args = std::make_shared<RobotSimArgs>(app);
  app.add_flag("--lockstep", args->lockstep,
               "Time stands still until each step is answered: as fast as the machine can, and the same "
               "samples every time");
  app.add_option(
         "--pace", args->pace,
         "With --lockstep: no faster than so many seconds of the world a second; 0: as fast as it goes")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str()
      ->type_name("FLOAT");
  return [args](Console& console) { return robot_sim(*args, console); };
}

}  // namespace

Verb robot_sim_verb() {
  return {
      .name = "robot-sim",
      .sentence = "A simulated robot that speaks the protocol of robot processes",
      .help =
          R"(Writes what the robot senses as JSON lines on standard output and reads commands from standard input,
as docs/formats/robot-process.md says: to try the protocol, or as a robot for --robot process:CMD. It starts
where the world's line begins, in real time unless --lockstep, and ends when its input does. With --images
it sends pictures (JPEG), otherwise the corners of tags. It also sends the truth, for a judge.

Exit code: 0 its input ended, 1 a picture could not be made, 2 wrong usage.

Examples:
  waymark robot-sim --world circuit24 < /dev/null | head -3
  waymark teach --robot "process:waymark robot-sim --world circuit24 --lockstep" --world circuit24 -o lap.mcap
)",
      .prepare = prepare_robot_sim,
      .verbs = {}};
}

}  // namespace waymark::cli

#include <fmt/format.h>
#include <CLI/App.hpp>

#include "waymark/cli/fresh_file.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/lesson.hpp"
#include "waymark/cli/live_driver.hpp"
#include "waymark/cli/live_robot.hpp"
#include "waymark/cli/live_steps.hpp"
#include "waymark/cli/live_story.hpp"

namespace waymark::cli {

void add_flags(CLI::App& app, LoneAnchorFlags& flags) {
  app.add_option("--anchor", flags.anchor,
                 "With --robot process: the tag on which the map will stand, for example tag36h11:0, or its "
                 "number; it is seen where the lap begins and ends")
      ->type_name("TAG");
  app.add_option("--tag-size-m", flags.tag_size_m, "With --robot process: side of the tags' black squares")
      ->check(CLI::Range(0.001, 10.0))
      ->type_name("FLOAT");
}

Status check_live_stage(Stage& stage, const LoneAnchorFlags& flags) {
  if (stage.process.empty() || !stage.world_yaml.empty()) {
    if (flags.anchor.empty() && flags.tag_size_m == 0) return {};
    return fail(ErrorCode::InvalidArgument, "the world already says what its tags are",
                {.key = flags.anchor.empty() ? "--tag-size-m" : "--anchor"},
                "Leave it out, or --world with --robot process:CMD.");
  }
  if (flags.anchor.empty() || flags.tag_size_m == 0)
    return fail(ErrorCode::InvalidArgument, "nobody knows the tags of this place",
                {.key = flags.anchor.empty() ? "--anchor" : "--tag-size-m"},
                "For example --anchor 0 --tag-size-m 0.16.");
  const auto anchor = tag_named(flags.anchor);
  if (!anchor) return tl::unexpected(anchor.error());
  place_lone_anchor(stage.simulated.world, *anchor, flags.tag_size_m);
  return {};
}

namespace {

/// Says, once each time, when a robot that is being taught has fallen silent.
class SilenceWatch {
 public:
  explicit SilenceWatch(Console& console) : console_(console) {}

  void hear(const Sample& sample) {
    odometry_.heard = odometry_.heard || std::holds_alternative<Odometry>(sample);
    camera_.heard = camera_.heard || std::holds_alternative<TagFrame>(sample) ||
                    std::holds_alternative<CameraFrame>(sample);
  }
  void look(Duration uptime) {
    check(odometry_, uptime, "odometry");
    check(camera_, uptime, "frame of the camera");
  }

 private:
  struct Stream {
    bool heard = false;  ///< since the last look
    bool said = false;
    Duration last{};
  };
  void check(Stream& stream, Duration uptime, const char* what) {
    constexpr double kSilent_s = 2;
    if (stream.heard) stream = {.heard = false, .said = false, .last = uptime};
    if (stream.said || to_seconds(uptime - stream.last) < kSilent_s) return;
    stream.said = true;
    console_.say(fmt::format("no {} for {:.0f} s: does the robot still run?", what, kSilent_s));
  }

  Console& console_;
  Stream odometry_{};
  Stream camera_{};
};

}  // namespace

Result<TeachReport> teach_live(const Stage& stage, const TeachJob& job, Console& console) {
  const Stopwatch watch;
  const auto driver = LiveDriver::make(job.driver, job.speed_m_s, stage.simulated);
  if (!driver) return tl::unexpected(driver.error());
  // Before the robot starts: a file that cannot be written should not cost a drive.
  Result<SampleRecorder> recorder =
      start_recording(job.output,
                      {.verb = "teach",
                       .driver = job.driver,
                       .options = fmt::format("driver:\n  speed_m_s: {}\n", job.speed_m_s),
                       .durable = job.durable},
                      stage);
  if (!recorder) return tl::unexpected(recorder.error());
  FreshFile fresh(job.output);
  const auto robot = LiveRobot::open(stage.process, stage.simulated.camera, console);
  if (!robot) return tl::unexpected(robot.error());
  Lesson lesson(teach_setup(stage.simulated), monitor_options(stage.simulated), job.images, *recorder,
                console);
  LapEnd end;
  SilenceWatch silence(console);
  PhaseViewers viewers(job.feed, stage.simulated, OperatorState::Teaching, job.driver == "keyboard");
  RobotListener listener;
  listener.on_sample = [&](const Sample& sample) {
    fresh.hear(sample);
    (*driver)->hear(sample);
    silence.hear(sample);
    return lesson.on_sample(sample);
  };
  listener.decide = [&](Duration uptime, SensorTime now) -> Result<DriverDecision> {
    silence.look(uptime);
    Result<DriverDecision> decision = (*driver)->drive(uptime, now);
    if (!decision) return decision;
    const PhaseViewers::Wish wish = viewers.hear(uptime);
    end.finished = decision->done = decision->done || wish.over;
    if (end.finished || wish.stand) decision->command = {};
    return decision;
  };
  if (const std::string usage = (*driver)->usage(); !usage.empty()) console.say(usage);
  const auto driven = (*robot)->drive(watched(listener, job.feed));
  const Status closed = recorder->close();  // also of a lap that ended badly: what was driven is kept
  console.end_progress();
  const bool hung_up = !driven && interrupted();  // the terminal went, and the keys with it
  if (!driven && !hung_up) return tl::unexpected(driven.error());
  fresh.keep();
  if (!closed) return tl::unexpected(closed.error());
  end.interrupted = hung_up || driven->interrupted;
  end.lap_s = hung_up ? 0 : driven->seconds;
  return report_of(lesson, end, watch);
}

}  // namespace waymark::cli

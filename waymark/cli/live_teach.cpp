#include <fmt/format.h>
#include <CLI/App.hpp>

#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/lap_recording.hpp"
#include "waymark/cli/live_steps.hpp"
#include "waymark/cli/session_viewers.hpp"
#include "waymark/live/fresh_file.hpp"
#include "waymark/live/inputs.hpp"
#include "waymark/live/live_robot.hpp"
#include "waymark/runtime/teach_session.hpp"

namespace waymark::cli {

void add_flags(CLI::App& app, LoneAnchorFlags& flags) {
  app.add_option("--anchor", flags.anchor,
                 "Anchor tag of the map with --robot process, for example tag36h11:0, or its id; it must be "
                 "in view where the lap begins and ends")
      ->type_name("TAG");
  app.add_option("--tag-size-m", flags.tag_size_m, "With --robot process: side of the tags' black squares")
      ->check(CLI::Range(0.001, 10.0))
      ->type_name("FLOAT");
}

Status check_live_setup(RobotSetup& setup, const LoneAnchorFlags& flags) {
  if (setup.process.empty() || !setup.world_yaml.empty()) {
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
  place_lone_anchor(setup.simulated.world, *anchor, flags.tag_size_m);
  return {};
}

Result<TeachReport> teach_live(const RobotSetup& setup, const TeachJob& job, Console& console) {
  const Stopwatch watch;
  const auto driver = make_lap_driver(job.driver, job.speed_m_s, setup.simulated);
  if (!driver) return tl::unexpected(driver.error());
  // Before the robot starts: a file that cannot be written should not cost a drive.
  Result<SampleRecorder> recorder =
      start_recording(job.output,
                      {.verb = "teach",
                       .driver = job.driver,
                       .options = fmt::format("driver:\n  speed_m_s: {}\n", job.speed_m_s),
                       .durable = job.durable},
                      setup);
  if (!recorder) return tl::unexpected(recorder.error());
  FreshFile fresh(job.output);
  const auto robot = LiveRobot::open(setup.process, setup.simulated.cameras(), words_on(console));
  if (!robot) return tl::unexpected(robot.error());
  PhaseViewers viewers(job.feed, setup.simulated, OperatorState::Teaching, job.driver == "keyboard");
  TeachSession session(**driver, lap_of(setup.simulated, lap_listener(*recorder, job.images, console)),
                       viewers.requests(), {.silence_s = 2});
  RobotListener listener = session.listener();
  listener.on_sample = [&](const Sample& sample) {
    fresh.receive(sample);
    return session.receive(sample);
  };
  if (const std::string usage = (*driver)->usage(); !usage.empty()) console.say(usage);
  const auto driven = (*robot)->drive(watched(std::move(listener), job.feed));
  const Status closed = recorder->close();  // also of a lap that ended badly: what was driven is kept
  console.end_progress();
  const bool hung_up = !driven && interrupted();  // the terminal went, and the keys with it
  if (!driven && !hung_up) return tl::unexpected(driven.error());
  fresh.keep();
  if (!closed) return tl::unexpected(closed.error());
  const LapEnd end =
      hung_up ? LapEnd{.finished = session.finished(), .interrupted = true} : session.end(*driven);
  return report_of(session.lap(), end, watch);
}

}  // namespace waymark::cli

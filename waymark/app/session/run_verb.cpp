#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/replay_flags.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/session/run_session.hpp"

namespace waymark::cli {
namespace {

struct RunArgs : RunRequest {
  explicit RunArgs(CLI::App& verb)
      : settings(verb),
        setup(verb, {}, true),
        scene(settings, Reach::SettingsOnly),
        options(settings, Reach::SettingsOnly) {
    add_fields(verb, live);
    add_fields(verb, static_cast<RunRequest&>(*this));
    verb.add_flag("--json", json, "Print one JSON object instead of text");
  }

  Settings settings;
  SetupFlags setup;
  SceneFlags scene;
  ReplayFlags options;
  ViewerOptions live{};
  bool json = false;
};

/// The robot in its world; a simulated robot is run as a process as well.
Result<RobotSetup> make_setup(const RunArgs& args) {
  Result<RobotSetup> made = args.setup.make();
  if (!made) return made;
  std::optional<DetectingCameraOptions> scene_camera;  // images from the robot's own process
  Status status = check_effects(args, *made, args.live.view, given_on(args.settings.app()));
  if (status) status = args.scene.apply(args.images, scene_camera);
  // A script can run at any speed. A person who drives or watches needs a fixed real-time factor.
  const SimulatedTime time{.lockstep = args.job.driver == "scripted" || args.live.view,
                           .pace = args.live.view ? args.pace : 0};
  if (status && made->process.empty())
    status = become_the_robot(*made, args.scene.as_words(args.setup, args.images), time);
  if (status) status = place_lone_anchor(*made, args.anchor, args.job.map);
  if (!status) return tl::unexpected(status.error());
  return made;
}

ExitCode run(const RunArgs& args, Console& console) {
  Result<RobotSetup> setup = make_setup(args);
  if (!setup) return fail_usage(setup.error(), console);
  SessionJob job = args.job;
  if (const Status read = take_calibration(args.calibration, job.replay); !read)
    return fail_with(read.error(), console);
  Status status = args.options.apply(job.replay);
  if (status) status = check_session(job);
  if (!status) return fail_usage(status.error(), console);
  const auto view = LivePage::open(args.live, *setup, control_from(console));
  if (!view) return fail_with(view.error(), console);
  if (*view) job.feed = &(*view)->feed();
  if (*view && args.settings.app().count("--driver") == 0) job.driver = "page";
  job.speed_m_s = std::min(job.speed_m_s, setup->simulated.model.limits.speed_m_s);
  const auto stop = listen_for_stop("run into " + args.job.folder.string(), console);
  const Result<SessionReport> report = run_session(*setup, job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report, interrupted_by()));
  if (report->interrupted) {
    console.note(
        fmt::format("stopped by {}: the robot is stationary, and the files are complete up to this point",
                    interrupted_by()));
    return ExitCode::Interrupted;
  }
  return succeeded(*report) ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb run_verb() {
  return {
      .name = "run",
      .sentence = "Teach, map and replay in one session, with one button",
      .help =
          R"(The whole session with a gamepad: Y (triangle) begins the lap. Hold the left shoulder button while the sticks
drive. Y ends the lap, and the lap is mapped while the robot is stationary. Y starts, pauses and resumes the replay;
B (circle) or any stick stops it. Other drivers do the same with keys, lines or buttons (--driver). The robot moves
only during teaching and replay, after the button was pressed. The reason for each stop is printed.
--view shows the robot in the browser, with the same buttons in addition to those of other drivers. One viewer
at a time has control. If this viewer disconnects, a taught robot stops and a replay pauses (docs/howto/live.md).
Exit code: 0 every replay was completed, 1 a replay or another step failed, 2 wrong usage, 130 stopped by
Ctrl-C.

Examples:
  waymark run --world circuit24 --driver scripted -o session
  waymark run --world circuit24 --driver keyboard -o session
  waymark run --world circuit24 --images --view --open -o session
  waymark run --robot "process:python3 my_robot.py" --robot-file my_robot.yaml --anchor 0 --tag-size-m 0.16 -o session
)",
      .prepare = prepared(run),
      .report = report_of<SessionReport>};
}

}  // namespace waymark::cli

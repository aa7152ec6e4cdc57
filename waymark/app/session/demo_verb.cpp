#include <algorithm>
#include <optional>
#include <thread>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/replay_flags.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/session/run_demo.hpp"
#include "waymark/app/session/run_session.hpp"

namespace waymark::cli {
namespace {

struct DemoArgs {
  explicit DemoArgs(CLI::App& app)
      : settings(app),
        setup(app, "circuit24"),
        scene(settings, Reach::SettingsOnly),
        options(settings, Reach::SettingsOnly) {
    add_fields(app, live);
    add_fields(app, job);
    app.add_flag("--json", json, "Print one JSON object (teach, map, replay, figures) instead of a table");
  }

  Settings settings;
  SetupFlags setup;
  SceneFlags scene;
  ReplayFlags options;
  ViewerOptions live{};
  DemoJob job{};
  bool json = false;
};

/// Runs the same session in real time with a page, until the user ends it.
ExitCode watched_demo(const DemoArgs& args, const DemoJob& demo, RobotSetup& setup, Console& console) {
  Status status = clear_demo_folder(args.job.folder);
  if (status)
    status = become_the_robot(setup, args.scene.as_words(args.setup, args.job.images),
                              {.lockstep = true, .pace = 1});
  if (!status) return fail_with(status.error(), console);
  const auto view = LivePage::open(args.live, setup, control_from(console));
  if (!view) return fail_with(view.error(), console);
  const SessionJob job{
      .folder = demo.folder, .driver = "scripted", .replay = demo.replay, .feed = &(*view)->feed()};
  const auto stop = listen_for_stop("demo into " + demo.folder, console);
  const Result<SessionReport> report = run_session(setup, job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  if (args.json) console.print(json_line(fields(*report)));
  return report->interrupted ? ExitCode::Interrupted : ExitCode::Ok;
}

ExitCode demo(const DemoArgs& args, Console& console) {
  DemoJob job = args.job;
  std::optional<DetectingCameraOptions> scene_camera;
  Status usable = args.options.apply(job.replay);  // report errors before files are read
  if (usable) usable = args.scene.apply(job.images, scene_camera);
  Result<RobotSetup> setup = usable ? args.setup.make() : tl::unexpected(usable.error());
  if (!setup) return fail_usage(setup.error(), console);
  setup->simulated.images = scene_camera;
  if (args.live.view || args.live.ros2) return watched_demo(args, job, *setup, console);
  if (job.images)
    setup->simulated.threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 16U));
  const Result<DemoReport> report = run_demo(*setup, job, control_from(console));
  if (interrupted()) {
    console.note("stopped: the recordings are kept");
    return ExitCode::Interrupted;
  }
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report, *setup, job));
  console.warn(report->map.warnings);
  if (!succeeded(report->replay)) console.note("the replay " + ending(report->replay, interrupted_by()));
  return succeeded(report->replay) ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb demo_verb() {
  return {
      .name = "demo",
      .sentence = "Teach, map and replay a lap in simulation, and compare with ground truth",
      .help =
          R"(Runs the steps of `waymark teach`, `waymark map` and `waymark replay` one after the other. Writes lap.mcap,
replay.mcap, the folder map/, figures (SVG and PNG: trajectory and tags against ground truth, error along the
path, tags in view), and report.html with everything on one page. A second run overwrites only files that `demo`
wrote.
With --view the session runs in real time and is shown in the browser, where it can be paused, stopped and
replayed again. It runs until Ctrl-C and writes the recordings and the map.
Exit code: 0 the route was driven to its end, 1 it was not (the reason is printed; table and figures exist),
2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark demo
  waymark demo -o out --seed 5 --json
  waymark demo --laps 3 --world limo-walls -o out
  waymark demo --view --images --open
)",
      .prepare = prepared(demo),
      .report = report_of<DemoReport>};
}

}  // namespace waymark::cli

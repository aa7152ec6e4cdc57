#include <algorithm>

#include "waymark/cli/parts.hpp"
#include "waymark/cli/run_args.hpp"
#include "waymark/live/run_session.hpp"

namespace waymark::cli {
namespace {

ExitCode run(const RunArgs& args, Console& console) {
  Result<RobotSetup> setup = args.make_setup();
  SessionJob job = args.job;
  job.folder = args.folder;
  Status status = setup ? Status() : tl::unexpected(setup.error());
  if (const Status read = take_calibration(args.calibration, job.replay); status && !read)
    return fail_with(read.error(), console);
  if (status) status = args.options.apply(job.replay);
  if (status && !job.replay.route.empty() && job.map.empty())
    status = fail(ErrorCode::InvalidArgument, "a lap that is taught has one route", {.key = "--route"},
                  "Give --map with the map that has this route.");
  if (!status) return fail_usage(status.error(), console);
  const auto view = start_page(args.live, *setup, console);
  if (!view) return fail_with(view.error(), console);
  if (*view) {
    job.feed = &(*view)->feed();
    if (args.driver->count() == 0) job.driver = "page";
  }
  job.speed_m_s = std::min(job.speed_m_s, setup->simulated.model.limits.speed_m_s);
  const auto stop = listen_for_stop("run into " + args.folder, console);
  const Result<SessionReport> report = run_session(*setup, job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report, interrupted_by()));
  if (report->interrupted) {
    console.say(
        fmt::format("stopped by {}: the robot stands, and the files are whole up to here", interrupted_by()));
    return ExitCode::Interrupted;
  }
  const bool well = std::ranges::all_of(report->replays, succeeded);
  return well && !report->map_failed ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb run_verb() {
  return {
      .name = "run",
      .sentence = "Teach, map and replay in one session, with one button",
      .help =
          R"(The whole session with a gamepad in hand: Y (triangle) begins the lap, and the left shoulder is held while
the sticks drive; Y again ends it, and the map is made while the robot stands; Y replays it, Y pauses and
goes on; B (circle) or any stick stops. Keyboards and programs can do the same (--driver). The robot moves only
while it is taught or replays, and nothing but the button sets it moving. Every stop has a reason in words.
--view shows the robot in the browser, with the same buttons; other drivers keep theirs. One viewer at a time
holds control. When it goes away while it teaches the robot stands, and a replay pauses (docs/howto/live.md).
Keys of --json: docs/reference/cli.md.

Exit code: 0 every replay came to its end, 1 one did not, or something failed, 2 wrong usage, 130 stopped by
Ctrl-C.

Examples:
  waymark run --world circuit24 --driver scripted -o session
  waymark run --world circuit24 --driver keyboard -o session
  waymark run --world circuit24 --images --view --open -o session
  waymark run --robot "process:python3 my_robot.py" --robot-file my_robot.yaml --anchor 0 --tag-size-m 0.16 -o session
)",
      .prepare = prepared(run)};
}

}  // namespace waymark::cli

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/lap_file.hpp"
#include "waymark/cli/live_steps.hpp"
#include "waymark/cli/live_view.hpp"
#include "waymark/cli/page_files.hpp"
#include "waymark/cli/session_run.hpp"
#include "waymark/cli/stop_request.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/live/own_robot.hpp"

namespace waymark::cli {
namespace {

struct RunArgs {
  explicit RunArgs(CLI::App& app) : stage(app, {}, true) { add_flags(app, live); }
  StageFlags stage;
  LiveFlags live{};
  CLI::Option* driver = nullptr;
  LoneAnchorFlags anchor;
  SessionJob job{};
  std::string folder;
  std::string calibration;
  bool images = false;
  double pace = 1;
  bool json = false;
};

/// The tags of the place by the flags, or by the map that is there already. What is wrong with that map is
/// said where it is read.
Status know_tags(const RunArgs& args, Stage& stage) {
  const bool told = !args.anchor.anchor.empty() || args.anchor.tag_size_m != 0;
  if (args.job.map.empty() || !stage.world_yaml.empty() || told) return check_live_stage(stage, args.anchor);
  const Result<MapFile> map = read_map(std::filesystem::path(args.job.map) / "map.yaml");
  if (map) place_lone_anchor(stage.simulated.world, map->anchor, map->tags.tags.at(map->anchor).size_m);
  return {};
}

Result<Stage> stage_of(const RunArgs& args) {
  Result<Stage> stage = args.stage.make();
  if (!stage) return stage;
  // A script does not care how fast the time passes; a person does, also one who only watches.
  const SimulatedTime time{.lockstep = args.job.driver == "scripted" || args.live.view,
                           .pace = args.live.view ? args.pace : 0};
  std::vector<std::string> words = args.stage.as_words();
  if (args.images) words.emplace_back("--images");
  Status status = stage->process.empty() ? become_the_robot(*stage, std::move(words), time) : Status();
  if (status) status = know_tags(args, *stage);
  if (!status) return tl::unexpected(status.error());
  return stage;
}

std::string session_words(const SessionReport& report) {
  std::string text = fmt::format("{} laps taught, {} replays\n", report.laps_taught, report.replays.size());
  for (const ReplayReport& replay : report.replays) {
    text += ending(replay);
    if (replay.judgement)
      text += fmt::format("; by the truth {:.3f} m rmse from the taught way, {:.3f} m worst",
                          replay.judgement->cross_track_rmse_m, replay.judgement->cross_track_max_m);
    text += '\n';
  }
  return text;
}

ExitCode run(const RunArgs& args, Console& console) {
  Result<Stage> stage = stage_of(args);
  SessionJob job = args.job;
  job.folder = args.folder;
  Status status = stage ? Status() : tl::unexpected(stage.error());
  if (const Status read = take_calibration(args.calibration, job.replay); status && !read) {
    console.say(read.error());
    return exit_code_of(read.error());
  }
  if (status && !job.replay.route.empty() && job.map.empty())
    status = fail(ErrorCode::InvalidArgument, "a lap that is taught has one route", {.key = "--route"},
                  "Give --map with the map that has this route.");
  if (!status) {
    console.say(status.error());
    return ExitCode::Usage;
  }
  const auto view = LiveView::start(args.live, *stage, console);
  if (!view) {
    console.say(view.error());
    return exit_code_of(view.error());
  }
  if (*view) {
    job.feed = &(*view)->feed();
    if (args.driver->count() == 0) job.driver = "page";
  }
  job.speed_m_s = std::min(job.speed_m_s, stage->simulated.model.limits.speed_m_s);
  const auto stop = hear_stop("run into " + args.folder, console);
  const Result<SessionReport> report = run_session(*stage, job, console);
  if (!report) {
    console.say(report.error());
    return exit_code_of(report.error());
  }
  console.print(args.json ? json_line(to_json(*report)) : session_words(*report));
  if (report->interrupted) {
    console.say(
        fmt::format("stopped by {}: the robot stands, and the files are whole up to here", interrupted_by()));
    return ExitCode::Interrupted;
  }
  const bool well = std::ranges::all_of(report->replays, succeeded);
  return well && !report->map_failed ? ExitCode::Ok : ExitCode::SomeFailed;
}

Run prepare_run(CLI::App& app) {
  const auto args = std::make_shared<RunArgs>(app);
  app.add_option("-o,--output", args->folder, "Folder for what is written: lap.mcap, map/, replay.mcap")
      ->required()
      ->type_name("FOLDER");
  args->driver = app.add_option(
      "--driver", args->job.driver,
      "Source of the operator's commands: gamepad, keyboard, lines (go, stop, quit and drive 0.3 -0.1 on "
      "standard input), scripted (with --world) or page (with --view, and then the default)");
  args->driver->capture_default_str()->type_name("NAME");
  app.add_option("--map", args->job.map, "Folder of an existing map, which makes teaching unnecessary")
      ->type_name("FOLDER");
  app.add_option("--route", args->job.replay.route, "With --map: a route of that name (`waymark routes`)")
      ->type_name("NAME");
  app.add_option("--record-images", args->job.images,
                 "Also record the pictures, of laps and replays: jpeg, or raw, ten times as large")
      ->check(CLI::IsMember({"jpeg", "raw"}))
      ->type_name("HOW");
  app.add_option(
         "--calibration", args->calibration,
         "Calibration of this robot (calibration.yaml), also the initial values of what replays learn")
      ->type_name("FILE");
  app.add_option("--speed-m-s", args->job.speed_m_s, "Speed at full forward deflection of the stick")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 5.0))
      ->type_name("FLOAT");
  app.add_option("--laps", args->job.replay.replay.laps, "Number of laps of a closed route")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1000.0))
      ->type_name("NUMBER");
  app.add_flag("--images", args->images, "Let the simulated robot send pictures");
  app.add_option("--pace", args->pace,
                 "Real-time factor with --view and a simulated robot: simulated seconds per second; 0: as "
                 "fast as possible")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str()
      ->type_name("FLOAT");
  add_flags(app, args->anchor);
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return run(*args, console); };
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
      .prepare = prepare_run,
      .verbs = {}};
}

}  // namespace waymark::cli

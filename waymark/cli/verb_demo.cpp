#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/live_view.hpp"
#include "waymark/cli/loop_steps.hpp"
#include "waymark/cli/page_files.hpp"
#include "waymark/cli/session_run.hpp"
#include "waymark/cli/stop_request.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/jobs/figure_files.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/report_page.hpp"
#include "waymark/live/own_robot.hpp"
#include "waymark/plot/loop_figures.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;

/// The replay is another day: other noise than in the teach lap.
constexpr std::uint64_t kReplaySeed = 1000;

struct DemoArgs {
  explicit DemoArgs(CLI::App& app) : stage(app, "circuit24") { add_flags(app, live); }

  StageFlags stage;
  LiveFlags live{};
  bool images = false;
  std::string folder = "demo";
  double laps = 1;
  bool durable = false;
  bool json = false;
};

struct DemoReport {
  TeachReport teach{};
  MapReport map{};
  ReplayReport replay{};
  std::vector<std::string> figures{};
  double wall_s = 0;
};

/// Says that a folder is a demo's own.
constexpr const char* kMark = "written-by-waymark-demo.txt";

/// What a demo writes, and what makes a folder that of a map, whose figures have the same names.
std::vector<std::string> own_names() {
  std::vector<std::string> names = {"lap.mcap",    "replay.mcap", "map",
                                    "report.html", "map.yaml",    "route.yaml"};
  for (const char* figure : {"trajectory", "map_error", "cross_track", "tags_in_view"}) {
    for (const char* suffix : {".svg", ".png"}) names.push_back(std::string(figure) + suffix);
  }
  return names;
}

/// A demo may be run again: its own recordings of last time go. A lap or a map of somebody else stays.
Status clear(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  for (const std::string& name : own_names()) {
    if (!error && fs::exists(folder / name) && !fs::exists(folder / kMark))
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("this folder holds a '{}' that no demo wrote", name),
                  {.source = folder.string()}, "Give the demo a folder of its own: -o NEW_FOLDER.");
  }
  if (!error && !write_text_file(folder / kMark, "`waymark demo` writes over the files in this folder.\n"))
    error = std::make_error_code(std::errc::permission_denied);
  for (const char* name : {"lap.mcap", "replay.mcap"}) {
    if (!error) fs::remove(folder / name, error);
  }
  if (!error) return {};
  return fail(ErrorCode::Unwritable, "cannot write here: " + error.message(), {.source = folder.string()});
}

Status write_figures(const fs::path& folder, const RecordedLap& lap, DemoReport& report) {
  const std::vector<std::string> both = {".svg", ".png"};
  const MapReport& map = report.map;
  const ReplayReport& replay = report.replay;
  using plot::PathLayer;
  const std::vector<PathLayer> layers = {{"taught, truth", map.true_path, map.true_tags, plot::kTruthColor},
                                         {"map", map.lap.trajectory, map.lap.map, plot::kEstimateColor},
                                         {"replayed, truth", replay.true_path, {}, plot::kTaughtColor}};
  std::vector<std::string>& files = report.figures;
  Status status = write_figure(folder / "trajectory.svg",
                               plot::path_figure("Taught, mapped, driven again", layers), both, files);
  if (status)
    status = write_figure(
        folder / "map_error.svg",
        plot::trajectory_error_figure("Error of the mapped trajectory", map.lap.trajectory, map.true_path),
        both, files);
  if (status)
    status = write_figure(
        folder / "cross_track.svg",
        plot::cross_track_figure("Replay beside the taught way", replay.true_path, replay.taught_path), both,
        files);
  if (status)
    status = write_figure(folder / "tags_in_view.svg",
                          plot::tags_in_view_figure("Tags in view, teach lap", lap.frames), both, files);
  return status;
}

/// report.html: what `waymark report FOLDER` writes.
Status write_report(const fs::path& folder, Console& console) {
  const Result<Runs> runs = read_runs({folder.string()}, control_from(console));
  if (!runs) return tl::unexpected(runs.error());
  const Result<plot::Page> page = report_page(*runs, control_from(console));
  if (!page) return tl::unexpected(page.error());
  const Result<std::string> html = plot::to_html(*page);
  return html ? write_text_file(folder / "report.html", *html) : tl::unexpected(html.error());
}

/// The three steps. What fails is said with the step it failed in.
Result<DemoReport> run_steps(const Stage& stage, const DemoArgs& args, Console& console) {
  const Stopwatch watch;
  const fs::path folder = args.folder;
  DemoReport report;
  const auto failed_in = [](const char* step, Error error) {
    error.message = fmt::format("{}: {}", step, error.message);
    return tl::unexpected(std::move(error));
  };
  if (Status status = clear(folder); !status) return tl::unexpected(status.error());
  const std::string lap = (folder / "lap.mcap").string();
  const std::string images = args.images ? "jpeg" : "";
  const Result<TeachReport> taught =
      teach_lap(stage, {.output = lap, .durable = args.durable, .images = images}, console);
  if (!taught) return failed_in("teach", taught.error());
  report.teach = *taught;
  if (taught->end.interrupted) return report;
  Result<MapReport> map = map_recording({.lap = lap, .folder = folder / "map"}, control_from(console));
  if (!map) return failed_in("map", map.error());
  report.map = std::move(*map);
  Stage another_day = stage;
  another_day.simulated.robot.seed += kReplaySeed;
  ReplayJob job{.folder = folder / "map",
                .output = (folder / "replay.mcap").string(),
                .durable = args.durable,
                .images = images};
  job.replay.laps = args.laps;
  Result<ReplayReport> replay = replay_route(another_day, job, console);
  if (!replay) return failed_in("replay", replay.error());
  report.replay = std::move(*replay);
  const Result<RecordedLap> recorded = read_lap_file(lap, silent_control());
  if (!recorded) return failed_in("figures", recorded.error());
  if (Status status = write_figures(folder, *recorded, report); !status)
    return failed_in("figures", status.error());
  if (Status status = write_report(folder, console); !status) return failed_in("report", status.error());
  report.wall_s = watch.seconds();
  return report;
}

std::string row(const char* step, const char* what, const std::string& value) {
  return fmt::format("{:<8}{:<38}{:>12}\n", step, what, value);
}

std::string table(const DemoReport& report) {
  const TeachSummary& teach = report.teach.summary;
  const auto metres = [](double value) { return fmt::format("{:.3f} m", value); };
  const auto degrees = [](double value) { return fmt::format("{:.2f} deg", value); };
  std::string text =
      row("teach", "driven, by odometry", fmt::format("{:.2f} m", teach.distance_m)) +
      row("", "two tags or more in view", fmt::format("{:.1f} %", 100 * teach.two_tags_fraction())) +
      row("", "tags seen", std::to_string(teach.seen.size())) +
      row("", "loop closed", teach.closed_loop ? "yes" : "no");
  if (const auto& e = report.map.tag_errors) {
    text += row("map", "tags, rmse", metres(e->rmse_m)) + row("", "tags, worst", metres(e->max_m)) +
            row("", "tags, orientation rmse", degrees(e->orientation_rmse_deg));
  }
  if (const auto& e = report.map.trajectory_errors) text += row("", "trajectory, rmse", metres(e->rmse_m));
  text += row("replay", "stops", std::to_string(report.replay.end.stops));
  if (const auto& j = report.replay.judgement) {
    text += row("", "laps completed", std::to_string(j->laps_completed)) +
            row("", "from the taught way, rmse", metres(j->cross_track_rmse_m)) +
            row("", "from the taught way, 95 %", metres(j->cross_track_p95_m)) +
            row("", "from the taught way, worst", metres(j->cross_track_max_m)) +
            row("", "heading, rmse", degrees(j->heading_rmse_deg)) +
            row("", "nearest tag to the hull", metres(j->min_clearance_m));
  }
  return text;
}

/// The same session by the clock, while somebody watches; it stays until it is ended.
ExitCode watched_demo(const DemoArgs& args, Stage& stage, Console& console) {
  std::vector<std::string> words = args.stage.as_words();
  if (args.images) words.emplace_back("--images");
  Status status = clear(args.folder);
  if (status) status = become_the_robot(stage, std::move(words), {.lockstep = true, .pace = 1});
  if (!status) {
    console.say(status.error());
    return ExitCode::SomeFailed;
  }
  const auto view = LiveView::start(args.live, stage, console);
  if (!view) {
    console.say(view.error());
    return exit_code_of(view.error());
  }
  SessionJob job{.folder = args.folder, .driver = "scripted", .feed = &(*view)->feed()};
  job.replay.durable = args.durable;
  job.replay.replay.laps = args.laps;
  const auto stop = hear_stop("demo into " + args.folder, console);
  const Result<SessionReport> report = run_session(stage, job, console);
  if (!report) {
    console.say(report.error());
    return ExitCode::SomeFailed;
  }
  if (args.json) console.print(json_line(to_json(*report)));
  return report->interrupted ? ExitCode::Interrupted : ExitCode::Ok;
}

ExitCode demo(const DemoArgs& args, Console& console) {
  Result<Stage> stage = args.stage.make();
  if (!stage) {
    console.say(stage.error());
    return ExitCode::Usage;
  }
  if (args.live.view) return watched_demo(args, *stage, console);
  if (args.images) {
    stage->simulated.pictures = SceneEyeOptions{};
    stage->simulated.threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 16U));
  }
  const Result<DemoReport> report = run_steps(*stage, args, console);
  if (interrupted()) {
    console.say("stopped: what was recorded is kept");
    return ExitCode::Interrupted;
  }
  if (!report) {
    console.say(report.error());
    return ExitCode::SomeFailed;
  }
  if (args.json) {
    console.print(json_line({{"teach", to_json(report->teach, (fs::path(args.folder) / "lap.mcap").string())},
                             {"map", to_json(report->map)},
                             {"replay", to_json(report->replay)},
                             {"figures", report->figures},
                             {"wall_s", report->wall_s}}));
  } else {
    console.print(fmt::format("{}, {}: against the truth, anchored, not aligned\n",
                              stage->simulated.world.name, stage->simulated.model.name) +
                  table(*report) +
                  fmt::format("{:.2f} s for {:.0f} s in the world; figures, recordings and report.html: {}\n",
                              report->wall_s, report->teach.end.lap_s + report->replay.end.lap_s,
                              args.folder));
  }
  for (const std::string& warning : report->map.warnings) console.say("warning: " + warning);
  if (!succeeded(report->replay)) console.say("the replay " + ending(report->replay));
  return succeeded(report->replay) ? ExitCode::Ok : ExitCode::SomeFailed;
}

Run prepare_demo(CLI::App& app) {
  const auto args = std::make_shared<DemoArgs>(app);
  app.add_option("-o,--output", args->folder, "Folder for recordings, map and figures")
      ->capture_default_str()
      ->type_name("FOLDER");
  app.add_option("--laps", args->laps, "Number of laps of the replay")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1000.0))
      ->type_name("NUMBER");
  app.add_flag("--images", args->images,
               "Render camera pictures, detect tags in them, and record them as JPEG");
  app.add_flag("--durable", args->durable, kDurableHelp);
  app.add_flag("--json", args->json, "One JSON object (teach, map, replay, figures) instead of a table");
  return [args](Console& console) { return demo(*args, console); };
}

}  // namespace

Verb demo_verb() {
  return {
      .name = "demo",
      .sentence = "Teach, map and replay a lap in simulation, and compare with the truth",
      .help =
          R"(The three steps in a row, as `waymark teach`, `waymark map` and `waymark replay` do them one by one. Leaves
lap.mcap, replay.mcap, the folder map/ and figures (SVG and PNG): trajectory and tags against the truth,
error over the way, tags in view; and report.html with all of it on one page. Run again, it writes over its own files, and over nobody else's.

With --view the same session goes by the clock and is shown in the browser, where it can be paused, stopped and
replayed again; it stays until Ctrl-C, and leaves the recordings and the map.

Exit code: 0 the route was driven to its end, 1 it was not (said in words; the table and the figures are there),
2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark demo
  waymark demo -o out --seed 5 --json
  waymark demo --laps 3 --world limo-walls -o out
  waymark demo --view --images --open
)",
      .prepare = prepare_demo,
      .verbs = {}};
}

}  // namespace waymark::cli

#include "waymark/app/session/run_demo.hpp"

#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "waymark/app/common/output_files.hpp"
#include "waymark/app/evaluate/report_page.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/plot/run_figures.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// Added to the seed of the teach lap to give the replay different noise.
constexpr std::uint64_t kReplaySeed = 1000;

/// Marks a folder that was written by a demo.
constexpr const char* kMark = "written-by-waymark-demo.txt";

/// Files that a demo writes. map.yaml is included because a map folder contains figures with the same names.
std::vector<std::string> own_names() {
  std::vector<std::string> names = {"lap.mcap",    "replay.mcap", "map",
                                    "report.html", "map.yaml",    "route.yaml"};
  for (const char* figure : {"trajectory", "map_error", "cross_track", "tags_in_view"}) {
    for (const char* suffix : {".svg", ".png"}) names.push_back(std::string(figure) + suffix);
  }
  return names;
}

Status write_figures(const fs::path& folder, const RecordedLap& lap, DemoReport& report) {
  const std::vector<std::string> both = {".svg", ".png"};
  const MapReport& map = report.map;
  const ReplayReport& replay = report.replay;
  using plot::PathLayer;
  const std::vector<PathLayer> layers = {
      {"taught (ground truth)", map.true_path, map.true_tags, plot::kTruthColor},
      {"map", map.lap.trajectory, map.lap.map, plot::kEstimateColor},
      {"replayed (ground truth)", replay.true_path, {}, plot::kTaughtColor}};
  std::vector<std::string>& files = report.figures;
  Status status = write_figure(folder / "trajectory.svg",
                               plot::path_figure("Taught and replayed path", layers), both, files);
  if (status)
    status = write_figure(
        folder / "map_error.svg",
        plot::trajectory_error_figure("Error of the mapped trajectory", map.lap.trajectory, map.true_path),
        both, files);
  if (status)
    status = write_figure(
        folder / "cross_track.svg",
        plot::cross_track_figure("Cross-track error of the replay", replay.true_path, replay.taught_path),
        both, files);
  if (status)
    status = write_figure(folder / "tags_in_view.svg",
                          plot::tags_in_view_figure("Tags in view, teach lap", lap.frames), both, files);
  return status;
}

/// Writes report.html in the same way as `waymark report FOLDER`.
Status write_report(const fs::path& folder, const JobControl& control) {
  const Result<Runs> runs = read_runs({folder.string()}, control);
  if (!runs) return tl::unexpected(runs.error());
  const Result<plot::Page> page = report_page(*runs, control);
  if (!page) return tl::unexpected(page.error());
  const Result<std::string> html = html_of(*page, control);
  return html ? write_text_file(folder / "report.html", *html) : tl::unexpected(html.error());
}

std::string row(const char* step, const char* what, const std::string& value) {
  return fmt::format("{:<8}{:<38}{:>12}\n", step, what, value);
}

}  // namespace

Status clear_demo_folder(const std::string& name_of_folder) {
  const fs::path folder = name_of_folder;
  std::error_code error;
  fs::create_directories(folder, error);
  for (const std::string& name : own_names()) {
    if (!error && fs::exists(folder / name) && !fs::exists(folder / kMark))
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("this folder contains a '{}' that was not written by `waymark demo`", name),
                  {.source = folder.string()}, "Choose another folder with `output`.");
  }
  if (!error && !write_text_file(folder / kMark, "`waymark demo` overwrites the files in this folder.\n"))
    error = std::make_error_code(std::errc::permission_denied);
  for (const char* name : {"lap.mcap", "replay.mcap"}) {
    if (!error) fs::remove(folder / name, error);
  }
  if (!error) return {};
  return fail(ErrorCode::Unwritable, "cannot write to the folder: " + error.message(),
              {.source = folder.string()}, "Choose another folder with `output`.");
}

Result<DemoReport> run_demo(const RobotSetup& setup, const DemoJob& job, const JobControl& control) {
  const Stopwatch watch;
  const fs::path folder = job.folder;
  DemoReport report;
  const auto failed_in = [](const char* step, Error error) {
    error.message = fmt::format("{}: {}", step, error.message);
    return tl::unexpected(std::move(error));
  };
  if (Status status = clear_demo_folder(job.folder); !status) return tl::unexpected(status.error());
  const std::string lap = (folder / "lap.mcap").string();
  const std::string images = job.images ? "jpeg" : "";
  const Result<TeachReport> taught =
      teach_lap(setup, {.output = lap, .durable = job.replay.durable, .images = images}, control);
  if (!taught) return failed_in("teach", taught.error());
  report.teach = *taught;
  if (taught->end.interrupted) return report;
  Result<MapReport> map = map_recording({.lap = lap, .folder = folder / "map"}, control);
  if (!map) return failed_in("map", map.error());
  report.map = std::move(*map);
  RobotSetup another_day = setup;
  another_day.simulated.robot.seed += kReplaySeed;
  ReplayJob again = job.replay;
  again.folder = folder / "map";
  again.output = (folder / "replay.mcap").string();
  again.images = images;
  Result<ReplayReport> replay = replay_route(another_day, again, control);
  if (!replay) return failed_in("replay", replay.error());
  report.replay = std::move(*replay);
  const Result<RecordedLap> recorded = read_lap_file(lap, silent(control));
  if (!recorded) return failed_in("figures", recorded.error());
  if (Status status = write_figures(folder, *recorded, report); !status)
    return failed_in("figures", status.error());
  if (Status status = write_report(folder, control); !status) return failed_in("report", status.error());
  report.wall_s = watch.seconds();
  return report;
}

std::string to_text(const DemoReport& report) {
  const TeachSummary& teach = report.teach.summary;
  const auto metres = [](double value) { return fmt::format("{:.3f} m", value); };
  const auto degrees = [](double value) { return fmt::format("{:.2f} deg", value); };
  std::string text =
      row("teach", "driven, by odometry", fmt::format("{:.2f} m", teach.distance_m)) +
      row("", "two or more tags in view", fmt::format("{:.1f} %", 100 * teach.two_tags_fraction())) +
      row("", "observed tags", std::to_string(teach.seen.size())) +
      row("", "loop closed", teach.closed_loop ? "yes" : "no");
  if (const auto& e = report.map.tag_errors) {
    text += row("map", "tags, rmse", metres(e->rmse_m)) + row("", "tags, max", metres(e->max_m)) +
            row("", "tags, orientation rmse", degrees(e->orientation_rmse_deg));
  }
  if (const auto& e = report.map.trajectory_errors) text += row("", "trajectory, rmse", metres(e->rmse_m));
  text += row("replay", "stops", std::to_string(report.replay.end.stops));
  if (const auto& j = report.replay.judgement) {
    text += row("", "laps completed", std::to_string(j->laps_completed)) +
            row("", "cross-track error, rmse", metres(j->cross_track_rmse_m)) +
            row("", "cross-track error, 95 %", metres(j->cross_track_p95_m)) +
            row("", "cross-track error, max", metres(j->cross_track_max_m)) +
            row("", "heading, rmse", degrees(j->heading_rmse_deg)) +
            row("", "hull to the nearest tag", metres(j->min_clearance_m));
  }
  return text;
}

std::string to_text(const DemoReport& report, const RobotSetup& setup, const DemoJob& job) {
  const double world_s = report.teach.end.lap_s + report.replay.end.lap_s;
  return fmt::format("{}, {}: against ground truth, in the map frame, without alignment\n",
                     setup.simulated.world.name, setup.simulated.model.name) +
         to_text(report) +
         fmt::format("{:.2f} s for {:.0f} s of simulated time; figures, recordings and report.html: {}\n",
                     report.wall_s, world_s, job.folder);
}

ReportFields fields(const DemoReport& report) {
  return {{"teach", "Report of `waymark teach`", report.teach},
          {"map", "Report of `waymark map`", report.map},
          {"replay", "Report of `waymark replay`", report.replay},
          {"figures", "Files of the figures", report.figures},
          {"wall_s", "Elapsed real time", report.wall_s}};
}

}  // namespace waymark

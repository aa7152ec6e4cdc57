#include "waymark/cli/report_run.hpp"

#include <algorithm>
#include <system_error>

#include <fmt/format.h>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/trajectory_files.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/config/trajectory_file.hpp"
#include "waymark/jobs/recording_kind.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;

Status add_drive(const std::string& file, Runs& runs, Console& console) {
  Result<RecordedLap> lap = read_lap_file(file, control_from(console));
  if (!lap) {
    Error error = lap.error();
    if (error.place.source.empty()) error.place.source = file;
    return tl::unexpected(std::move(error));
  }
  for (const Error& problem : lap->setup.problems) runs.warnings.push_back(file + ": " + to_string(problem));
  DriveRun drive{.file = file, .lap = std::move(*lap)};
  if (Result<EstimatedTrajectory> estimate = read_estimate(file, topics::kEstimate); estimate)
    drive.estimate = std::move(*estimate);
  runs.drives.push_back(std::move(drive));
  return {};
}

Status add_map(const fs::path& folder, Runs& runs) {
  Result<MapFile> map = read_map(folder / "map.yaml");
  if (!map) return tl::unexpected(map.error());
  MapRun run{.folder = folder, .map = std::move(*map)};
  std::error_code ignored;
  if (fs::exists(folder / "route.yaml", ignored)) {
    Result<Route> route = read_route(folder / "route.yaml");
    if (!route) return tl::unexpected(route.error());
    run.route = std::move(*route);
  }
  if (fs::exists(folder / "trajectory.txt", ignored)) {
    Result<Trajectory> trajectory = read_trajectory(folder / "trajectory.txt");
    if (!trajectory) return tl::unexpected(trajectory.error());
    run.trajectory = std::move(*trajectory);
  }
  runs.maps.push_back(std::move(run));
  return {};
}

/// The recordings that lie in a folder, oldest first: that is the order in which they were made.
std::vector<std::string> recordings_in(const fs::path& folder) {
  std::vector<std::pair<fs::file_time_type, std::string>> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.is_regular_file(error) && looks_like_recording(entry.path().string()))
      found.emplace_back(entry.last_write_time(error), entry.path().string());
  }
  std::ranges::sort(found);
  std::vector<std::string> files;
  for (auto& [time, file] : found) files.push_back(std::move(file));
  return files;
}

Status add_folder(const fs::path& folder, Runs& runs, Console& console) {
  std::error_code ignored;
  const std::size_t before = runs.drives.size() + runs.maps.size();
  for (const fs::path& place : {folder, folder / "map"}) {
    if (!fs::exists(place / "map.yaml", ignored)) continue;
    if (Status status = add_map(place, runs); !status) return status;
  }
  for (const std::string& file : recordings_in(folder)) {
    if (Status status = add_drive(file, runs, console); !status) return status;
  }
  if (runs.drives.size() + runs.maps.size() > before) return {};
  return fail(ErrorCode::NotFound, "the folder holds neither a recording nor a map",
              {.source = folder.string()},
              "Give a folder that `waymark demo` or `waymark map` wrote, or recordings.");
}

}  // namespace

Result<Runs> read_runs(const std::vector<std::string>& paths, Console& console) {
  Runs runs;
  for (const std::string& path : paths) {
    std::error_code ignored;
    Status status;
    if (fs::is_directory(path, ignored))
      status = add_folder(path, runs, console);
    else if (fs::path(path).filename() == "map.yaml")
      status = add_map(fs::path(path).parent_path(), runs);
    else
      status = add_drive(path, runs, console);
    if (!status) return tl::unexpected(status.error());
  }
  return runs;
}

const DriveRun* drive_of(const MapRun& map, const Runs& runs) {
  const auto& provenance = map.map.provenance;
  const auto named = std::ranges::find(provenance, "recording", &std::pair<std::string, std::string>::first);
  if (named == provenance.end()) return nullptr;
  const auto made_of = [&](const DriveRun& drive) {
    return fs::path(drive.file).filename().string() == named->second;
  };
  const auto drive = std::ranges::find_if(runs.drives, made_of);
  return drive == runs.drives.end() ? nullptr : &*drive;
}

Result<plot::Page> report_page(const Runs& runs, Console& console) {
  plot::Page page{.title = "Waymark report"};
  for (const DriveRun& drive : runs.drives) {
    plot::PageSection section = drive_section(drive);
    if (!section.figures.empty()) page.sections.push_back(std::move(section));
  }
  for (const MapRun& map : runs.maps) page.sections.push_back(map_section(map, drive_of(map, runs), console));
  if (auto section = comparison_section(runs)) page.sections.push_back(std::move(*section));
  if (page.sections.empty())
    return fail(ErrorCode::NotFound, "nothing in these files can be drawn: no tags, odometry or poses", {},
                "`waymark info FILE` says what a recording holds.");
  page.subtitle =
      fmt::format("{} drive{}, {} map{}. Truth green, odometry blue, estimate red.", runs.drives.size(),
                  runs.drives.size() == 1 ? "" : "s", runs.maps.size(), runs.maps.size() == 1 ? "" : "s");
  return page;
}

}  // namespace waymark::cli

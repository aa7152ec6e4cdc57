#include "waymark/app/evaluate/report_page.hpp"

#include <algorithm>
#include <fstream>
#include <map>
#include <system_error>

#include <fmt/format.h>

#include "waymark/app/common/profile_table.hpp"
#include "waymark/app/common/staged_folder.hpp"
#include "waymark/app/common/trajectory_files.hpp"
#include "waymark/base/counted.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/trajectory_file.hpp"
#include "waymark/recording/log_formats.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

Status add_drive(const std::string& file, Runs& runs, const JobControl& control) {
  Result<RecordedLap> lap = read_lap_file(file, control);
  if (!lap) {
    Error error = lap.error();
    if (error.place.source.empty()) error.place.source = file;
    return tl::unexpected(std::move(error));
  }
  for (const Error& problem : lap->setup.problems) runs.warnings.push_back(file + ": " + to_string(problem));
  DriveRun drive{.file = file, .lap = std::move(*lap)};
  if (Result<EstimatedTrajectory> estimate = read_estimate(file, topics::kEstimate, control); estimate)
    drive.estimate = std::move(*estimate);
  if (Result<RecordingProfile> profile = profile_of(file, silent(control)); profile)
    drive.profile = std::move(*profile);
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
  files.reserve(found.size());
  for (auto& [time, file] : found) files.push_back(std::move(file));
  return files;
}

Status add_folder(const fs::path& folder, Runs& runs, const JobControl& control) {
  std::error_code ignored;
  const std::size_t before = runs.drives.size() + runs.maps.size();
  for (const fs::path& place : {folder, folder / "map"}) {
    if (!fs::exists(place / "map.yaml", ignored)) continue;
    if (Status status = add_map(place, runs); !status) return status;
  }
  for (const std::string& file : recordings_in(folder)) {
    if (Status status = control.go_on(); !status) return status;
    if (Status status = add_drive(file, runs, control); !status) return status;
  }
  if (runs.drives.size() + runs.maps.size() > before) return {};
  return fail(ErrorCode::NotFound, "the folder holds neither a recording nor a map",
              {.source = folder.string()},
              "Give a folder that `waymark demo` or `waymark map` wrote, or recordings.");
}

/// A report may be written anew; over a page of somebody else's it is not.
Status check_output(const fs::path& output, bool force) {
  const std::string suffix = output.extension().string();
  if (suffix != ".html" && suffix != ".htm")
    return fail(ErrorCode::InvalidArgument, "a report is a page: its name ends with .html",
                {.source = output.string(), .key = "--output"});
  std::error_code ignored;
  if (!force && fs::is_regular_file(output, ignored)) {
    std::string head(4096, '\0');
    std::ifstream(output, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size()));
    if (head.find(plot::kPageMark) == std::string::npos)
      return fail(ErrorCode::Unwritable, "there is a page already that no `waymark report` wrote",
                  {.source = output.string()}, "Give another name with -o, or --force to replace it.");
  }
  return check_output_file(output);
}

}  // namespace

Result<Runs> read_runs(const std::vector<std::string>& paths, const JobControl& control) {
  Runs runs;
  for (const std::string& path : paths) {
    std::error_code ignored;
    Status status = control.go_on();
    if (!status) return tl::unexpected(status.error());
    if (fs::is_directory(path, ignored))
      status = add_folder(path, runs, control);
    else if (fs::path(path).filename() == "map.yaml")
      status = add_map(fs::path(path).parent_path(), runs);
    else
      status = add_drive(path, runs, control);
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

Result<plot::Page> report_page(const Runs& runs, const JobControl& control) {
  plot::Page page{.title = "Waymark report"};
  for (const DriveRun& drive : runs.drives) {
    plot::PageSection section = drive_section(drive);
    if (!section.figures.empty()) page.sections.push_back(std::move(section));
  }
  for (const MapRun& map : runs.maps) page.sections.push_back(map_section(map, drive_of(map, runs), control));
  if (auto section = comparison_section(runs)) page.sections.push_back(std::move(*section));
  if (page.sections.empty())
    return fail(ErrorCode::NotFound, "nothing in these files can be drawn: no tags, odometry or poses", {},
                "`waymark info FILE` says what a recording holds.");
  page.subtitle = fmt::format("{}, {}. Truth green, odometry blue, estimate red.",
                              counted(runs.drives.size(), "drive"), counted(runs.maps.size(), "map"));
  return page;
}

Result<ReportSummary> write_report(const std::vector<std::string>& paths, const fs::path& output, bool force,
                                   const JobControl& control) {
  if (Status status = check_output(output, force); !status) return tl::unexpected(status.error());
  const Result<Runs> runs = read_runs(paths, control);
  if (!runs) return tl::unexpected(runs.error());
  for (const std::string& warning : runs->warnings) control.note("warning: " + warning);
  const Result<plot::Page> page = report_page(*runs, control);
  const Result<std::string> html = page ? plot::to_html(*page) : tl::unexpected(page.error());
  if (!html) return tl::unexpected(html.error());
  if (Status status = control.go_on(); !status) return tl::unexpected(status.error());
  if (Status status = write_text_file(output, *html); !status) return tl::unexpected(status.error());
  return ReportSummary{.sections = page->sections.size(), .bytes = html->size()};
}

std::vector<plot::PageFigure> figures_of(const plot::Page& page) {
  std::vector<plot::PageFigure> figures;
  std::map<std::string, int> taken;
  for (const plot::PageSection& section : page.sections) {
    for (plot::PageFigure figure : section.figures) {
      figure.caption = section.title;
      if (const int number = ++taken[figure.name]; number > 1) figure.name += fmt::format("_{}", number);
      figures.push_back(std::move(figure));
    }
  }
  return figures;
}

}  // namespace waymark

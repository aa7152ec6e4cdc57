#include <system_error>

#include <fmt/format.h>

#include "waymark/cli/figure_files.hpp"
#include "waymark/cli/map_steps.hpp"
#include "waymark/cli/route_files.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/trajectory_file.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/plot/loop_figures.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;

/// Named routes of an older map (route-best.yaml) are not routes of the new one: route-best.1.yaml. A lap
/// that extends this very map as a route of its own leaves them, but for the one of its name. Their names.
std::string move_named_routes(const MapJob& job, int version, std::error_code& error) {
  std::error_code ignored;
  const bool same = !job.route_name.empty() && fs::equivalent(job.extended_folder, job.folder, ignored);
  std::string moved;
  for (const std::string& name : route_names(job.folder)) {
    if (same && name != job.route_name) continue;
    const std::string stem = file_name_for_route("route", name, "");
    if (!error)
      fs::rename(job.folder / (stem + ".yaml"), job.folder / fmt::format("{}.{}.yaml", stem, version), error);
    if (name != job.route_name) moved += (moved.empty() ? "" : ", ") + name;
  }
  return moved;
}

/// A pause at a place of the older route is none at a place of the new one, whoever drove it.
void tell_of_stations(const MapJob& job, MapReport& report) {
  const Result<Route> older = read_route(job.folder / route_file_name(job.route_name));
  if (!older || older->stations.empty()) return;
  std::string names;
  for (const Station& station : older->stations) names += (names.empty() ? "" : ", ") + station.name;
  report.warnings.push_back(
      fmt::format("the stations of the older route ({}) are not on the new one: put them there again with "
                  "`waymark routes {}`",
                  names, job.folder.string()));
}

/// What stands there already moves aside: map.yaml becomes map.1.yaml, or the next number that is free.
Status keep_versions(const MapJob& job, MapReport& report) {
  const fs::path& folder = job.folder;
  std::error_code error;
  if (!fs::exists(folder / "map.yaml", error)) return {};
  int version = 1;
  const auto kept = [&](const char* name) { return folder / fmt::format("{}.{}.yaml", name, version); };
  while (fs::exists(kept("map"), error) || fs::exists(kept("route"), error)) ++version;
  for (const char* name : {"map", "route"}) {
    const fs::path now = folder / fmt::format("{}.yaml", name);
    if (!error && fs::exists(now, error)) fs::copy_file(now, kept(name), error);
  }
  const std::string moved = error ? "" : move_named_routes(job, version, error);
  if (!moved.empty())
    report.warnings.push_back(
        fmt::format("the routes of the older map ({}) are none of this one: they were set aside as "
                    "route-NAME.{}.yaml. A lap becomes a further route of a map that stays with --extend {} "
                    "--route-name NAME",
                    moved, version, job.folder.string()));
  if (!error) return {};
  return fail(ErrorCode::Unwritable, "cannot keep the older map: " + error.message(),
              {.source = folder.string()});
}

/// A lap that becomes one more route of a map elsewhere: the map's other routes come along.
Status take_routes_along(const MapJob& job) {
  std::error_code error;
  if (job.route_name.empty() || fs::equivalent(job.extended_folder, job.folder, error)) return {};
  error.clear();
  std::vector<std::string> routes = route_names(job.extended_folder);
  routes.emplace_back();
  for (const std::string& route : routes) {
    if (route == job.route_name) continue;
    for (const char* stem : {"route", "trajectory", "truth_trajectory"}) {
      const std::string suffix = std::string_view(stem) == "route" ? ".yaml" : ".txt";
      const std::string name = file_name_for_route(stem, route, suffix);
      std::error_code ignored;
      if (error || !fs::exists(job.extended_folder / name, ignored)) continue;
      fs::copy_file(job.extended_folder / name, job.folder / name, fs::copy_options::overwrite_existing,
                    error);
    }
  }
  if (!error) return {};
  return fail(ErrorCode::Unwritable, "cannot take the map's other routes along: " + error.message(),
              {.source = job.folder.string()});
}

/// The trajectory's covariances, one line a pose: what coordinates and axes say of it, lower triangle by
/// rows.
std::string covariance_csv(const MappedLap& lap) {
  std::string text =
      "# stamp_s, covariance of x y z [m] and of the rotation about x y z of the map [rad], lower triangle "
      "by rows\n";
  for (std::size_t i = 0; i < lap.trajectory.size(); ++i) {
    const StampedPose& pose = lap.trajectory[i];
    const Matrix6 P = coordinate_covariance(Uncertain<SE3>{pose.map_T_base, lap.trajectory_covariance[i]});
    text += fmt::format("{:.9f}", to_seconds(pose.stamp.time_since_epoch()));
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c <= r; ++c) text += fmt::format(",{:.6g}", P(r, c));
    }
    text += '\n';
  }
  return text;
}

Status write_texts(const RecordedLap& recorded, const MapJob& job, const MapFile& map, MapReport& report) {
  const auto of_route = [&](const char* stem, const char* suffix) {
    return file_name_for_route(stem, job.route_name, suffix);
  };
  const auto keep = [&](const std::string& name, auto&& write) -> Status {
    const fs::path path = job.folder / name;
    Status status = write(path);
    if (status) report.files.push_back(path.string());
    return status;
  };
  const auto text = [](const std::string& words) {
    return [&words](const fs::path& path) { return write_text_file(path, words); };
  };
  Status status = keep("map.yaml", [&](const fs::path& path) { return write_map(path, map); });
  if (status)
    status = keep(of_route("route", ".yaml"),
                  [&](const fs::path& path) { return write_route(path, report.lap.route); });
  if (status) status = keep(of_route("trajectory", ".txt"), text(to_tum(report.lap.trajectory)));
  if (status && !report.lap.trajectory_covariance.empty())
    status = keep(of_route("trajectory_covariance", ".csv"), text(covariance_csv(report.lap)));
  if (const auto robot = robot_yaml_of(recorded); status && robot) status = keep("robot.yaml", text(*robot));
  if (status && !report.true_path.empty())
    status = keep(of_route("truth_trajectory", ".txt"), text(to_tum(report.true_path)));
  return status;
}

/// What optimising changed: the chain's map and way beside the optimised ones.
Status write_before_and_after(const MapJob& job, MapReport& report) {
  const BundleFigures& figures = *report.lap.bundle;
  std::vector<plot::PathLayer> layers;
  if (!report.true_path.empty() || !report.true_tags.tags.empty())
    layers.push_back({"truth", report.true_path, report.true_tags, plot::kTruthColor});
  layers.push_back(
      {"before: from tag to tag", figures.start_trajectory, figures.start_map, plot::kTaughtColor});
  layers.push_back({"after: adjusted", report.lap.trajectory, report.lap.map, plot::kEstimateColor});
  return write_figure(job.folder / file_name_for_route("before_after", job.route_name, ".svg"),
                      plot::path_figure("Before and after adjustment", layers), {".svg"}, report.files);
}

Status write_figures(const RecordedLap& recorded, const MapJob& job, MapReport& report) {
  using plot::PathLayer;
  std::vector<PathLayer> layers;
  if (!report.true_path.empty() || !report.true_tags.tags.empty())
    layers.push_back({"truth", report.true_path, report.true_tags, plot::kTruthColor});
  layers.push_back({"map", report.lap.trajectory, report.lap.map, plot::kEstimateColor});
  const std::vector<std::string> svg = {".svg"};
  Status status = write_figure(job.folder / file_name_for_route("map", job.route_name, ".svg"),
                               plot::path_figure("Map and trajectory", layers), svg, report.files);
  if (status && report.lap.bundle) status = write_before_and_after(job, report);
  if (status && !report.true_path.empty()) {
    status = write_figure(
        job.folder / file_name_for_route("error", job.route_name, ".svg"),
        plot::trajectory_error_figure("Error of the trajectory", report.lap.trajectory, report.true_path),
        svg, report.files);
  }
  if (!status || recorded.frames.empty()) return status;
  return write_figure(job.folder / file_name_for_route("tags_in_view", job.route_name, ".svg"),
                      plot::tags_in_view_figure("Tags in view", recorded.frames), svg, report.files);
}

}  // namespace

Status write_map_folder(const RecordedLap& recorded, const MapJob& job, const MapFile& map,
                        MapReport& report) {
  std::error_code error;
  fs::create_directories(job.folder, error);
  if (error)
    return fail(ErrorCode::Unwritable, "cannot make the folder: " + error.message(),
                {.source = job.folder.string()});
  tell_of_stations(job, report);
  Status status = keep_versions(job, report);
  if (status) status = take_routes_along(job);
  if (status) status = write_texts(recorded, job, map, report);
  if (status) status = write_figures(recorded, job, report);
  return status;
}

}  // namespace waymark::cli

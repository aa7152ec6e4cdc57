#include <algorithm>
#include <cmath>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/figure_files.hpp"
#include "waymark/app/common/route_files.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/common/staged_folder.hpp"
#include "waymark/app/map/map_steps.hpp"
#include "waymark/config/calibration_file.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/trajectory_file.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/plot/loop_figures.hpp"
#include "waymark/replay/route_gaps.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// Whether the lap becomes one more route of the map that stands where it is written.
bool adds_a_route(const MapJob& job) {
  std::error_code ignored;
  return !job.route_name.empty() && fs::equivalent(job.extended_folder, job.folder, ignored);
}

/// The named routes of an older map, which are none of the new one.
std::vector<std::string> orphaned_routes(const MapJob& job) {
  std::vector<std::string> names = adds_a_route(job) ? std::vector<std::string>() : route_names(job.folder);
  std::erase(names, job.route_name);
  return names;
}

/// A further route leaves the files of the others.
std::vector<std::string> older_files(const MapJob& job) {
  std::vector<std::string> routes = orphaned_routes(job);
  routes.push_back(job.route_name);
  if (!job.route_name.empty() && !adds_a_route(job)) routes.emplace_back();
  return files_of_map(routes);
}

void tell_of_orphaned_routes(const MapJob& job, int number, MapReport& report) {
  const std::vector<std::string> names = orphaned_routes(job);
  if (names.empty()) return;
  report.warnings.push_back(
      fmt::format("the routes of the older map ({}) are none of this one: they were set aside as "
                  "route-NAME.{}.yaml. A lap becomes a further route of a map that stays with --extend {} "
                  "--route-name NAME",
                  fmt::join(names, ", "), number, job.folder.string()));
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
                  names, shell_word(job.folder.string())));
}

/// A lap that becomes one more route of a map elsewhere: the map's other routes come along.
Status take_routes_along(const MapJob& job, const fs::path& folder) {
  std::error_code error;
  if (job.route_name.empty() || adds_a_route(job)) return {};
  std::vector<std::string> routes = route_names(job.extended_folder);
  routes.emplace_back();
  for (const std::string& route : routes) {
    if (route == job.route_name) continue;
    for (const char* stem : {"route", "trajectory", "truth_trajectory"}) {
      const std::string suffix = std::string_view(stem) == "route" ? ".yaml" : ".txt";
      const std::string name = file_name_for_route(stem, route, suffix);
      std::error_code ignored;
      if (error || !fs::exists(job.extended_folder / name, ignored)) continue;
      fs::copy_file(job.extended_folder / name, folder / name, error);
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

/// The route with what a replay has to know of its lap and its map.
Route noted_route(const RecordedLap& recorded, const MapFile& map, const MapReport& report) {
  Route route = with_map(report.lap.route, map.tags);
  if (!recorded.frames.empty())
    route.longest_without_tags_m = longest_without_tags_m(report.lap.trajectory, recorded.frames, map.tags);
  return route;
}

/// What the lap tells of the robot's odometry, as a calibration; nothing from a lap without any.
std::optional<Calibration> odometry_of(const RecordedLap& recorded, const MappedLap& lap) {
  if (!lap.bundle || !(lap.bundle->odometry_scales_sigma.yaw > 0) || !lap.bundle->turn_noise)
    return std::nullopt;
  const OdometryScales& scales = lap.bundle->odometry_scales;
  const OdometryScales& sigma = lap.bundle->odometry_scales_sigma;
  const TurnNoise& noise = *lap.bundle->turn_noise;
  Calibration found{.provenance = {{"method", "map"}}};
  if (const auto yaml = robot_yaml_of(recorded)) {
    if (const auto robot = parse_robot(*yaml, "robot.yaml"))
      found.provenance.emplace_back("robot", robot->model.name);
  }
  found.values["odometry_scale"] = {.value = scales.distance, .sigma = sigma.distance};
  found.values["yaw_gain"] = {.value = scales.yaw, .sigma = std::max(sigma.yaw, noise.scale_sigma)};
  found.values["yaw_noise_rad_sqrt_m"] = {.value = noise.rad_sqrt_m,
                                          .sigma = noise.rad_sqrt_m / std::sqrt(2.0 * noise.stretches)};
  return found;
}

/// The robot's file, with the camera where the lap has it.
Result<std::string> robot_as_found(const std::string& robot, const MappedLap& lap) {
  if (!lap.bundle || !lap.bundle->mounting_used) return robot;
  return with_camera_mounting(robot, lap.bundle->mounting->base_T_cam);
}

Status write_texts(const RecordedLap& recorded, const MapJob& job, const MapFile& map, const fs::path& folder,
                   MapReport& report) {
  const auto of_route = [&](const char* stem, const char* suffix) {
    return file_name_for_route(stem, job.route_name, suffix);
  };
  const auto keep = [&](const std::string& name, auto&& write) -> Status {
    const fs::path path = folder / name;
    Status status = write(path);
    if (status) report.files.push_back(path.string());
    return status;
  };
  const auto text = [](const std::string& words) {
    return [&words](const fs::path& path) { return write_text_file(path, words); };
  };
  Status status = keep("map.yaml", [&](const fs::path& path) { return write_map(path, map); });
  if (status)
    status = keep(of_route("route", ".yaml"), [&](const fs::path& path) {
      return write_route(path, noted_route(recorded, map, report));
    });
  if (status) status = keep(of_route("trajectory", ".txt"), text(to_tum(report.lap.trajectory)));
  if (status && !report.lap.trajectory_covariance.empty())
    status = keep(of_route("trajectory_covariance", ".csv"), text(covariance_csv(report.lap)));
  if (const auto odometry = odometry_of(recorded, report.lap); status && odometry)
    status = keep(of_route("odometry", ".yaml"),
                  [&](const fs::path& path) { return write_calibration(path, *odometry); });
  if (const auto robot = robot_yaml_of(recorded); status && robot) {
    const Result<std::string> found = robot_as_found(*robot, report.lap);
    if (!found) return tl::unexpected(found.error());
    status = keep("robot.yaml", text(*found));
  }
  if (status && !report.true_path.empty())
    status = keep(of_route("truth_trajectory", ".txt"), text(to_tum(report.true_path)));
  return status;
}

/// What optimising changed: the chain's map and way beside the optimised ones.
Status write_before_and_after(const MapJob& job, const fs::path& folder, MapReport& report) {
  const BundleFigures& figures = *report.lap.bundle;
  std::vector<plot::PathLayer> layers;
  if (!report.true_path.empty() || !report.true_tags.tags.empty())
    layers.push_back({"truth", report.true_path, report.true_tags, plot::kTruthColor});
  layers.push_back(
      {"before: from tag to tag", figures.start_trajectory, figures.start_map, plot::kTaughtColor});
  layers.push_back({"after: adjusted", report.lap.trajectory, report.lap.map, plot::kEstimateColor});
  return write_figure(folder / file_name_for_route("before_after", job.route_name, ".svg"),
                      plot::path_figure("Before and after adjustment", layers), {".svg"}, report.files);
}

Status write_figures(const RecordedLap& recorded, const MapJob& job, const fs::path& folder,
                     MapReport& report) {
  using plot::PathLayer;
  std::vector<PathLayer> layers;
  if (!report.true_path.empty() || !report.true_tags.tags.empty())
    layers.push_back({"truth", report.true_path, report.true_tags, plot::kTruthColor});
  layers.push_back({"map", report.lap.trajectory, report.lap.map, plot::kEstimateColor});
  const std::vector<std::string> svg = {".svg"};
  Status status = write_figure(folder / file_name_for_route("map", job.route_name, ".svg"),
                               plot::path_figure("Map and trajectory", layers), svg, report.files);
  if (status && report.lap.bundle) status = write_before_and_after(job, folder, report);
  if (status && !report.true_path.empty()) {
    status = write_figure(
        folder / file_name_for_route("error", job.route_name, ".svg"),
        plot::trajectory_error_figure("Error of the trajectory", report.lap.trajectory, report.true_path),
        svg, report.files);
  }
  if (!status || recorded.frames.empty()) return status;
  return write_figure(folder / file_name_for_route("tags_in_view", job.route_name, ".svg"),
                      plot::tags_in_view_figure("Tags in view", recorded.frames), svg, report.files);
}

}  // namespace

Status write_map_folder(const RecordedLap& recorded, const MapJob& job, const MapFile& map,
                        const Stopwatch& watch, MapReport& report) {
  Result<StagedFolder> staged = StagedFolder::open(job.folder);
  if (!staged) return tl::unexpected(staged.error());
  const fs::path& folder = staged->path();
  const std::vector<std::string> older = older_files(job);
  tell_of_stations(job, report);
  Status status = take_routes_along(job, folder);
  if (status) status = write_texts(recorded, job, map, folder, report);
  if (status) status = write_figures(recorded, job, folder, report);
  if (!status) return staged->failed(status.error());
  tell_of_orphaned_routes(job, staged->number_for(older), report);
  report.wall_s = watch.seconds();
  report.peak_rss_mib = peak_rss_mib();
  const std::string summary = file_name_for_route("summary", job.route_name, ".json");
  status = write_text_file(folder / summary, to_json(report).dump(2) + "\n");
  if (!status) return staged->failed(status.error());
  report.files.push_back((folder / summary).string());
  Result<std::vector<std::string>> aside = staged->put_in_place(older);
  if (!aside) return tl::unexpected(aside.error());
  report.set_aside = std::move(*aside);
  for (std::string& file : report.files) file = (job.folder / fs::path(file).filename()).string();
  return {};
}

}  // namespace waymark

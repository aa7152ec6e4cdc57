#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/cli/figure_files.hpp"
#include "waymark/cli/loop_steps.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/trajectory_file.hpp"
#include "waymark/plot/loop_figures.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;

/// Compares with what is known of the truth. Nothing is aligned, so the map must stand where the truth does.
Status compare_with_truth(const RecordedLap& recorded, const MapJob& job, const TeachSetup& setup,
                          MapReport& report) {
  std::optional<World> world = job.truth;
  if (!world) {
    Result<std::optional<World>> recorded_world = true_world(recorded);
    if (!recorded_world) return tl::unexpected(recorded_world.error());
    world = std::move(*recorded_world);
  }
  const MappedTag* true_anchor = world ? world->tags.find(setup.anchor) : nullptr;
  if (world && true_anchor == nullptr) {
    report.warnings.push_back(
        fmt::format("{} is not in the world: not compared with it", to_string(setup.anchor)));
    return {};
  }
  if (true_anchor != nullptr && !(true_anchor->map_T_tag.inverse() * setup.map_T_anchor).log().isZero(1e-6)) {
    report.warnings.emplace_back("the anchor does not stand where the truth has it: not compared");
    return {};
  }
  if (world) {
    report.true_tags = world->tags;
    report.tag_errors = tag_map_errors(report.lap.map, world->tags);
  }
  if (recorded.truth.empty()) return {};
  report.true_path = recorded.truth;
  report.trajectory_errors = trajectory_errors(report.lap.trajectory, recorded.truth);
  return {};
}

Status write_texts(const RecordedLap& recorded, const MapJob& job, const TeachSetup& setup,
                   MapReport& report) {
  const MapFile map{
      .tags = report.lap.map,
      .observations = report.lap.observations,
      .anchor = setup.anchor,
      .provenance = {{"method", job.options.method}, {"recording", fs::path(job.lap).filename().string()}}};
  const auto keep = [&](const char* name, auto&& write) -> Status {
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
    status = keep("route.yaml", [&](const fs::path& path) { return write_route(path, report.lap.route); });
  if (status) status = keep("trajectory.txt", text(to_tum(report.lap.trajectory)));
  if (const auto robot = robot_yaml_of(recorded); status && robot) status = keep("robot.yaml", text(*robot));
  if (status && !report.true_path.empty())
    status = keep("truth_trajectory.txt", text(to_tum(report.true_path)));
  return status;
}

Status write_figures(const RecordedLap& recorded, const MapJob& job, MapReport& report) {
  using plot::PathLayer;
  std::vector<PathLayer> layers;
  if (!report.true_path.empty() || !report.true_tags.tags.empty())
    layers.push_back({"truth", report.true_path, report.true_tags, plot::kTruthColor});
  layers.push_back({"map", report.lap.trajectory, report.lap.map, plot::kEstimateColor});
  const std::vector<std::string> svg = {".svg"};
  Status status = write_figure(job.folder / "map.svg", plot::path_figure("Map and trajectory", layers), svg,
                               report.files);
  if (status && !report.true_path.empty()) {
    status = write_figure(
        job.folder / "error.svg",
        plot::trajectory_error_figure("Error of the trajectory", report.lap.trajectory, report.true_path),
        svg, report.files);
  }
  if (!status) return status;
  return write_figure(job.folder / "tags_in_view.svg",
                      plot::tags_in_view_figure("Tags in view", recorded.frames), svg, report.files);
}

}  // namespace

Result<MapReport> map_recording(const MapJob& job) {
  const Stopwatch watch;
  const Result<RecordedLap> recorded = read_lap_file(job.lap);
  if (!recorded) return tl::unexpected(recorded.error());
  const auto in_recording = [&](Error error) {
    if (error.place.source.empty()) error.place.source = job.lap;
    return tl::unexpected(std::move(error));
  };
  const Result<TeachSetup> setup = setup_of(*recorded, job.overrides);
  if (!setup) return in_recording(setup.error());
  Result<MappedLap> lap = map_lap(recorded->frames, *setup, job.options);
  if (!lap) return in_recording(lap.error());
  MapReport report{.method = job.options.method, .lap = std::move(*lap)};
  for (const Error& problem : recorded->setup.problems) report.warnings.push_back(to_string(problem));
  report.warnings.insert(report.warnings.end(), report.lap.warnings.begin(), report.lap.warnings.end());
  Status status = compare_with_truth(*recorded, job, *setup, report);
  if (!status) return in_recording(status.error());
  std::error_code error;
  fs::create_directories(job.folder, error);
  if (error)
    return fail(ErrorCode::Unwritable, "cannot make the folder: " + error.message(),
                {.source = job.folder.string()});
  if (status) status = write_texts(*recorded, job, *setup, report);
  if (status) status = write_figures(*recorded, job, report);
  if (!status) return tl::unexpected(status.error());
  report.wall_s = watch.seconds();
  report.peak_rss_mib = peak_rss_mib();
  report.files.push_back((job.folder / "summary.json").string());
  status = write_text_file(report.files.back(), to_json(report).dump(2) + "\n");
  if (!status) return tl::unexpected(status.error());
  return report;
}

nlohmann::ordered_json to_json(const MapReport& report) {
  const auto number = [](const auto& errors, auto member) -> nlohmann::ordered_json {
    if (!errors) return nullptr;
    return (*errors).*member;
  };
  const MappedLap& lap = report.lap;
  return {{"method", report.method},
          {"tags", lap.map.tags.size()},
          {"frames", lap.frames},
          {"frames_without_pose", lap.frames_without_pose},
          {"route_length_m", lap.route.length_m},
          {"route_closed", lap.route.closed},
          {"tag_rmse_m", number(report.tag_errors, &TagMapErrors::rmse_m)},
          {"tag_max_m", number(report.tag_errors, &TagMapErrors::max_m)},
          {"tag_orientation_rmse_deg", number(report.tag_errors, &TagMapErrors::orientation_rmse_deg)},
          {"trajectory_rmse_m", number(report.trajectory_errors, &TrajectoryErrors::rmse_m)},
          {"trajectory_max_m", number(report.trajectory_errors, &TrajectoryErrors::max_m)},
          {"wall_s", report.wall_s},
          {"peak_rss_mib", report.peak_rss_mib},
          {"warnings", report.warnings}};
}

}  // namespace waymark::cli

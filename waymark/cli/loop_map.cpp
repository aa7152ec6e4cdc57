#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/cli/figure_files.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/loop_steps.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/trajectory_file.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/map_comparison.hpp"
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

/// What stands there already moves aside: map.yaml becomes map.1.yaml, or the next number that is free.
Status keep_versions(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder / "map.yaml", error)) return {};
  int version = 1;
  const auto kept = [&](const char* name) { return folder / fmt::format("{}.{}.yaml", name, version); };
  while (fs::exists(kept("map"), error) || fs::exists(kept("route"), error)) ++version;
  for (const char* name : {"map", "route"}) {
    const fs::path now = folder / fmt::format("{}.yaml", name);
    if (!error && fs::exists(now, error)) fs::copy_file(now, kept(name), error);
  }
  if (!error) return {};
  return fail(ErrorCode::Unwritable, "cannot keep the older map: " + error.message(),
              {.source = folder.string()});
}

/// The trajectory's covariances, one line a pose: what coordinates and axes say of it, lower triangle by
/// rows.
std::string covariance_csv(const MappedLap& lap) {
  std::string text =
      "# stamp_s, covariance of x y z [m] and of the rotation about x y z of the map [rad], lower triangle "
      "by rows\n";
  for (std::size_t i = 0; i < lap.trajectory.size(); ++i) {
    const StampedPose& pose = lap.trajectory[i];
    const Matrix6 P =
        coordinate_covariance(Uncertain<SE3>{pose.map_T_base, lap.bundle->trajectory_covariance[i]});
    text += fmt::format("{:.9f}", to_seconds(pose.stamp.time_since_epoch()));
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c <= r; ++c) text += fmt::format(",{:.6g}", P(r, c));
    }
    text += '\n';
  }
  return text;
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
  if (status && report.lap.bundle)
    status = keep("trajectory_covariance.csv", text(covariance_csv(report.lap)));
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

Result<MapReport> map_recording(const MapJob& job, Console& console) {
  const MapProgress progress = [&](const std::string& stage, int iteration, double cost) {
    console.live(fmt::format("{}: step {}, cost {:.0f}", stage, iteration, cost));
    return !interrupted();
  };
  const Stopwatch watch;
  const Result<RecordedLap> recorded = read_lap_file(job.lap, &console, job.finder);
  const auto in_recording = [&](Error error) {
    if (error.place.source.empty()) error.place.source = job.lap;
    return tl::unexpected(std::move(error));
  };
  if (!recorded) return in_recording(recorded.error());
  const Result<TeachSetup> setup = setup_of(*recorded, job.overrides);
  if (!setup) return in_recording(setup.error());
  Result<MappedLap> lap = map_lap({recorded->frames, recorded->odometry}, *setup, job.options, progress);
  console.end_progress();
  if (!lap) return in_recording(lap.error());
  if (interrupted())
    return fail(ErrorCode::Unwritable, "stopped before the map was finished: nothing was written",
                {.source = job.folder.string()});
  MapReport report{.method = job.options.method, .lap = std::move(*lap)};
  for (const Error& problem : recorded->setup.problems) report.warnings.push_back(to_string(problem));
  report.warnings.insert(report.warnings.end(), report.lap.warnings.begin(), report.lap.warnings.end());
  if (job.prior) {
    const Result<MapComparison> comparison = compare_maps(report.lap.map, *job.prior);
    if (!comparison) report.warnings.push_back("prior map: " + to_string(comparison.error()));
    const std::vector<std::string> words = comparison ? in_words(*comparison) : std::vector<std::string>();
    report.warnings.insert(report.warnings.end(), words.begin(), words.end());
  }
  Status status = compare_with_truth(*recorded, job, *setup, report);
  if (!status) return in_recording(status.error());
  std::error_code error;
  fs::create_directories(job.folder, error);
  if (error)
    return fail(ErrorCode::Unwritable, "cannot make the folder: " + error.message(),
                {.source = job.folder.string()});
  if (status) status = keep_versions(job.folder);
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
  const auto of_bundle = [&](auto value) -> nlohmann::ordered_json {
    if (!lap.bundle) return nullptr;
    return value(*lap.bundle);
  };
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
          {"reprojection_rms_px", of_bundle([](const BundleFigures& b) { return b.rms_px; })},
          {"corner_noise_ratio", of_bundle([](const BundleFigures& b) { return b.noise_ratio; })},
          {"sightings_rejected", of_bundle([](const BundleFigures& b) { return b.rejected; })},
          {"iterations", of_bundle([](const BundleFigures& b) { return b.iterations; })},
          {"odometry_distance_scale",
           of_bundle([](const BundleFigures& b) { return b.odometry_scales.distance; })},
          {"odometry_yaw_scale", of_bundle([](const BundleFigures& b) { return b.odometry_scales.yaw; })},
          {"wall_s", report.wall_s},
          {"peak_rss_mib", report.peak_rss_mib},
          {"warnings", report.warnings}};
}

}  // namespace waymark::cli

#include "waymark/app/map/map_recording.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/changed_tag_fields.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/common/route_files.hpp"
#include "waymark/app/common/sensor_finding_fields.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/common/thin_cut_fields.hpp"
#include "waymark/app/common/wrong_size_fields.hpp"
#include "waymark/app/map/map_extension.hpp"
#include "waymark/app/map/recording_sketch.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/calibration_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/evaluation/dead_reckoning.hpp"
#include "waymark/evaluation/trajectory_scores.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/lap/map_comparison.hpp"
#include "waymark/pipeline/lap_mapper.hpp"
#include "waymark/plot/run_figures.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

// Laps whose recordings contain tag poses but no corners.

/// Wheel odometry, with yaw rates from the gyro if there is one, because they are more accurate.
std::vector<Odometry> best_odometry(const RecordedLap& recorded) {
  const Trajectory gyro = gyro_odometry(recorded.odometry, recorded.imu);
  if (gyro.size() < 2) return recorded.odometry;
  std::vector<Odometry> odometry;
  for (const StampedPose& pose : gyro) odometry.push_back({pose.stamp, project_to_plane(pose.map_T_base)});
  return odometry;
}

}  // namespace

Result<MapFile> map_poses(const RecordedLap& recorded, const MapJob& job, MapReport& report) {
  if (job.overrides.anchor || job.overrides.map_T_anchor || job.extend)
    return fail(ErrorCode::Unsupported,
                "the recording contains tag poses but no corners, so the map frame is that of the base at "
                "the start of the lap",
                {}, "Omit `anchor`, `anchor_pose` and `extend`.");
  PoseLap lap{.frames = recorded.tag_poses, .odometry = best_odometry(recorded)};
  auto sizes = tag_sizes_of(recorded, job.overrides);
  if (!sizes) return tl::unexpected(sizes.error());
  lap.sizes = std::move(*sizes);
  if (Status status = lap.sizes.check(); !status) return tl::unexpected(status.error());
  if (const auto facts = recorded.setup.metadata.find(lap_facts::kMetadata);
      facts != recorded.setup.metadata.end() && facts->second.contains(lap_facts::kAnchor))
    report.warnings.push_back(
        fmt::format("the map frame is that of the base at the start of the lap, not the anchor {}: the "
                    "recording contains tag poses but no corners",
                    facts->second.at(lap_facts::kAnchor)));
  if (recorded.setup.base_T_cam) {
    lap.base_T_cam = *recorded.setup.base_T_cam;
  } else {
    lap.base_T_cam = SE3(body_R_optical(), Eigen::Vector3d::Zero());
    report.warnings.emplace_back(
        "camera mounting unknown; initialised above the origin of the base, facing forward (set `robot`)");
  }
  Result<MappedPoseLap> mapped = map_pose_lap(lap, {.points = job.points, .route = job.options.route});
  if (!mapped) return tl::unexpected(mapped.error());
  report.method = "poses";
  report.lap = std::move(mapped->lap);
  report.poses = mapped->figures;
  MapFile map = map_file_of(job, mapped->anchor, report.lap);
  map.provenance[0].second = report.method;
  return map;
}

namespace {

/// Adds a warning for each change relative to the prior map. Fails if that map is of another place.
Status compare_with_prior(const MapJob& job, MapReport& report) {
  if (!job.prior) return {};
  for (const std::string& note : job.prior->notes) report.warnings.push_back("prior map: " + note);
  std::vector<PriorPoint> points;
  for (const Landmark& landmark : job.prior->landmarks.all())
    points.push_back({static_cast<int>(landmark.tag.number), landmark.map_T_tag.translation().head<2>()});
  const Result<MapComparison> comparison = job.prior->tags.tags.empty()
                                               ? compare_points(report.lap.map, points)
                                               : compare_maps(report.lap.map, job.prior->tags);
  if (!comparison) {
    Error error = comparison.error();
    error.message = "the lap cannot be compared with the prior map: " + error.message;
    error.place.key = "prior";
    error.hint += " Without `prior`, the lap is mapped.";
    return tl::unexpected(std::move(error));
  }
  report.prior_agreeing = comparison->agreeing;
  report.prior_rms_m = comparison->rms_m;
  for (std::string& change : describe(*comparison)) report.warnings.push_back(std::move(change));
  return {};
}

// Output files.

/// Whether the lap becomes an additional route of the existing map in the output folder.
bool adds_a_route(const MapJob& job) {
  std::error_code ignored;
  return !job.route_name.empty() && fs::equivalent(job.extended_folder, job.folder, ignored);
}

/// The named routes in the output folder that belong to an older map, not to the new one.
std::vector<std::string> orphaned_routes(const MapJob& job) {
  std::vector<std::string> names = adds_a_route(job) ? std::vector<std::string>() : route_names(job.folder);
  std::erase(names, job.route_name);
  return names;
}

/// Files in the output folder that will be renamed to backups. Files of other routes on the same map are left
/// untouched.
std::vector<std::string> replaced_files(const MapJob& job) {
  std::vector<std::string> routes = orphaned_routes(job);
  routes.push_back(job.route_name);
  if (!job.route_name.empty() && !adds_a_route(job)) routes.emplace_back();
  return files_of_map(routes);
}

void warn_of_orphaned_routes(const MapJob& job, int number, MapReport& report) {
  const std::vector<std::string> names = orphaned_routes(job);
  if (names.empty()) return;
  report.warnings.push_back(
      fmt::format("the routes of the older map ({}) do not apply to the new map and were renamed to "
                  "route-NAME.{}.yaml; to add a route to a map, set `extend={}` and `route_name=NAME`",
                  fmt::join(names, ", "), number, job.folder.string()));
}

/// Warns that the stations on the older route are not valid for the new one.
void warn_of_stations(const MapJob& job, MapReport& report) {
  const Result<Route> older = read_route(job.folder / route_file_name(job.route_name));
  if (!older || older->stations.empty()) return;
  std::string names;
  for (const Station& station : older->stations) names += (names.empty() ? "" : ", ") + station.name;
  report.warnings.push_back(
      fmt::format("the stations of the older route ({}) are not on the new route; place them again with "
                  "`waymark routes {}`",
                  names, shell_word(job.folder.string())));
}

/// Copies the other routes of the extended map if the lap becomes an additional route in a different folder.
Status copy_other_routes(const MapJob& job, const fs::path& folder) {
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
  return fail(ErrorCode::Unwritable, "cannot copy the other routes of the map: " + error.message(),
              {.source = job.folder.string()});
}

/// Covariances of the trajectory, one line per pose: the lower triangle, row by row, for position and
/// rotation about the map axes.
std::string covariance_csv(const MappedLap& lap) {
  std::string text =
      "# stamp_s, covariance of x y z [m] and of the rotation about x y z of the map [rad], lower triangle, "
      "row by row\n";
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

/// The route, with the data from the lap and the map that are needed to replay it.
Route route_for_replay(const RecordedLap& recorded, const MapFile& map, const MapReport& report) {
  Route route = with_map(report.lap.route, map.tags);
  if (!recorded.frames.empty())
    route.longest_without_tags_m = longest_without_tags_m(report.lap.trajectory, recorded.frames, map.tags);
  return route;
}

/// Odometry parameters estimated from the lap, as a calibration. Empty if the lap has no odometry.
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
  found.values["yaw_scale"] = {.value = scales.yaw, .sigma = std::max(sigma.yaw, noise.scale_sigma)};
  found.values["yaw_noise_rad_sqrt_m"] = {.value = noise.rad_sqrt_m,
                                          .sigma = noise.rad_sqrt_m / std::sqrt(2.0 * noise.stretches)};
  return found;
}

/// The content of the robot file. If the map was made with a camera mounting estimated from the lap, it
/// contains that mounting.
Result<std::string> robot_with_mounting(const std::string& robot, const MappedLap& lap) {
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
  const auto text = [](const std::string& content) {
    return [&content](const fs::path& path) { return write_text_file(path, content); };
  };
  Status status = keep("map.yaml", [&](const fs::path& path) { return write_map(path, map); });
  if (status)
    status = keep(of_route("route", ".yaml"), [&](const fs::path& path) {
      return write_route(path, route_for_replay(recorded, map, report));
    });
  if (status) status = keep(of_route("trajectory", ".txt"), text(to_tum(report.lap.trajectory)));
  if (status && !report.lap.trajectory_covariance.empty())
    status = keep(of_route("trajectory_covariance", ".csv"), text(covariance_csv(report.lap)));
  if (const auto odometry = odometry_of(recorded, report.lap); status && odometry)
    status = keep(of_route("odometry", ".yaml"),
                  [&](const fs::path& path) { return write_calibration(path, *odometry); });
  if (const auto robot = robot_yaml_of(recorded); status && robot) {
    const Result<std::string> found = robot_with_mounting(*robot, report.lap);
    if (!found) return tl::unexpected(found.error());
    status = keep("robot.yaml", text(*found));
  }
  if (status && !report.true_path.empty())
    status = keep(of_route("truth_trajectory", ".txt"), text(to_tum(report.true_path)));
  return status;
}

/// Draws the map and the trajectory before and after optimisation.
Status write_before_and_after(const MapJob& job, const fs::path& folder, MapReport& report) {
  const BundleFigures& figures = *report.lap.bundle;
  std::vector<plot::PathLayer> layers;
  if (!report.true_path.empty() || !report.true_tags.tags.empty())
    layers.push_back({"truth", report.true_path, report.true_tags, plot::kTruthColor});
  layers.push_back(
      {"before: chain of tags", figures.start_trajectory, figures.start_map, plot::kTaughtColor});
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

/// Writes all files in a map folder, or none. Existing files are kept as backups.
Status write_map_folder(const RecordedLap& recorded, const MapJob& job, const MapFile& map,
                        const Stopwatch& watch, MapReport& report) {
  Result<StagedFolder> staged = StagedFolder::open(job.folder);
  if (!staged) return tl::unexpected(staged.error());
  const fs::path& folder = staged->path();
  const std::vector<std::string> replaced = replaced_files(job);
  warn_of_stations(job, report);
  Status status = copy_other_routes(job, folder);
  if (status) status = write_texts(recorded, job, map, folder, report);
  if (status) status = write_figures(recorded, job, folder, report);
  if (!status) return staged->failed(status.error());
  warn_of_orphaned_routes(job, staged->number_for(replaced), report);
  report.wall_s = watch.seconds();
  report.peak_rss_mib = peak_rss_mib();
  const std::string summary = file_name_for_route("summary", job.route_name, ".json");
  status = write_text_file(folder / summary, json_text(fields(report)));
  if (!status) return staged->failed(status.error());
  report.files.push_back((folder / summary).string());
  Result<std::vector<std::string>> backups = staged->put_in_place(replaced);
  if (!backups) return tl::unexpected(backups.error());
  report.renamed_files = std::move(*backups);
  for (std::string& file : report.files) file = (job.folder / fs::path(file).filename()).string();
  return {};
}

// Running the job.

/// The true trajectory, aligned with the estimated one.
Result<Trajectory> aligned_to(const Trajectory& estimated, const Trajectory& truth) {
  constexpr Duration kMaxGap = std::chrono::milliseconds(500);
  std::vector<PosePair> pairs;
  for (const StampedPose& pose : truth) {
    if (const auto there = pose_at(estimated, pose.stamp, kMaxGap))
      pairs.push_back({{.stamp = pose.stamp, .map_T_base = pose.map_T_base}, *there});
  }
  const Result<Alignment> map_A_truth = align(pairs, AlignmentKind::Se3);
  if (!map_A_truth) return tl::unexpected(map_A_truth.error());
  Trajectory aligned = truth;
  for (StampedPose& pose : aligned) pose.map_T_base = (*map_A_truth)(pose.map_T_base);
  return aligned;
}

/// Compares only the trajectories, after aligning them, because the transform between their frames is
/// unknown.
void compare_aligned(const RecordedLap& recorded, MapReport& report) {
  Result<Trajectory> aligned = aligned_to(report.lap.trajectory, recorded.truth);
  if (!aligned) {
    report.warnings.push_back(
        fmt::format("not compared with the true trajectory: {}", aligned.error().message));
    return;
  }
  report.true_path = std::move(*aligned);
  report.truth_aligned = true;
  report.trajectory_errors = trajectory_errors(report.lap.trajectory, report.true_path);
}

/// Compares the result with the ground truth, if known. The trajectory is aligned only if neither the world
/// nor the anchor pose is known; otherwise the map frame must be that of the ground truth.
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
        fmt::format("not compared with the ground truth: {} is not in the world", to_string(setup.anchor)));
    return {};
  }
  if (true_anchor != nullptr && !in_frame_of_truth(setup.map_T_anchor, true_anchor->map_T_tag)) {
    report.warnings.emplace_back(
        "not compared with the ground truth, in which the anchor has a different pose");
    return {};
  }
  if (world) {
    report.true_tags = world->tags;
    report.tag_errors = tag_map_errors(report.lap.map, world->tags);
  }
  if (recorded.truth.empty()) return {};
  if (!world && !setup.anchor_pose_given) {
    compare_aligned(recorded, report);
    return {};
  }
  report.true_path = recorded.truth;
  report.trajectory_errors = trajectory_errors(report.lap.trajectory, report.true_path);
  return {};
}

/// Maps the recorded samples without copies of them.
Result<MappedLap> map_samples(RecordedLap& recorded, const TeachSetup& setup, const MapLapOptions& options,
                              const MapProgress& progress) {
  TaughtLap taught{std::move(recorded.frames), std::move(recorded.odometry), std::move(recorded.imu)};
  Result<MappedLap> lap = map_lap_in_place(taught, setup, options, progress);
  recorded.frames = std::move(taught.frames);
  recorded.odometry = std::move(taught.odometry);
  recorded.imu = std::move(taught.imu);
  return lap;
}

Result<MapFile> map_corners(RecordedLap& recorded, const MapJob& job, const SetupOverrides& overrides,
                            const MapLapOptions& options, const MapProgress& progress, MapReport& report) {
  Result<TeachSetup> setup = setup_of(recorded, overrides);
  if (!setup) return tl::unexpected(setup.error());
  for (std::string& warning : setup->sizes.warnings()) report.warnings.push_back(std::move(warning));
  if (options.prior) {
    for (const auto& [tag, mapped] : options.prior->map.tags) setup->sizes.size_by_tag_m[tag] = mapped.size_m;
  }
  Result<MappedLap> lap = map_samples(recorded, *setup, options, progress);
  if (!lap) return tl::unexpected(lap.error());
  report.method = to_string(options.method);
  report.lap = std::move(*lap);
  if (Status status = compare_with_truth(recorded, job, *setup, report); !status)
    return tl::unexpected(status.error());
  return map_file_of(job, setup->anchor, report.lap);
}

/// Makes a map from tag corners or, if there are none, from tag poses.
Result<MapFile> map_corners_or_poses(RecordedLap& recorded, const MapJob& job, const MapProgress& progress,
                                     MapReport& report) {
  if (recorded.frames.empty() && !recorded.tag_poses.empty()) {
    Result<MapFile> map = map_poses(recorded, job, report);
    if (map && !recorded.truth.empty()) compare_aligned(recorded, report);
    return map;
  }
  SetupOverrides overrides = job.overrides;
  MapLapOptions options = job.options;
  if (Status status = prepare_extension(job, recorded, overrides, options); !status)
    return tl::unexpected(status.error());
  return map_corners(recorded, job, overrides, options, progress, report);
}

/// Warns if the lap was already used for the extended map, and stores its content in the new map.
void note_content(const MapJob& job, const RecordingSketch& recording, MapFile& map, MapReport& report) {
  std::vector<RecordingSketch> sketches = {recording};
  if (job.extend) {
    const std::vector<RecordingSketch> older = sketches_of(job.extend->provenance);
    sketches.insert(sketches.end(), older.begin(), older.end());
    std::string repeated = repeated_recording(job.extend->provenance, recording);
    if (!repeated.empty()) report.warnings.push_back(std::move(repeated));
  }
  add_sketches(sketches, map.provenance);
}

/// Warns if the given tag size differs from sizes in the extended map, because those are not changed.
void warn_of_size(const MapJob& job, MapReport& report) {
  if (!job.extend || !job.overrides.tag_size_m) return;
  const double asked = *job.overrides.tag_size_m;
  int others = 0;
  double known = asked;
  for (const auto& [tag, mapped] : job.extend->tags.tags) {
    others += mapped.size_m != asked ? 1 : 0;
    if (mapped.size_m != asked) known = mapped.size_m;
  }
  if (others == 0) return;
  report.warnings.push_back(
      fmt::format("`tag_size_m={}` applies only to new tags; the size of {} in the map remains {} m. If that "
                  "size is wrong, correct size_m in the map, or map the lap from scratch",
                  asked, counted(others, "tag"), known));
}

/// Warns if a replay will stop at a tag beside the route. A route that it refuses anyway is not checked.
void check_clearance(const RecordedLap& recorded, MapReport& report) {
  const auto yaml = robot_yaml_of(recorded);
  if (!yaml || sideways_motion(report.lap.route)) return;
  const Result<RobotDescription> robot = parse_robot(*yaml, "robot.yaml");
  if (!robot) return;
  report.nearest_tag = nearest_tag(report.lap.route, report.lap.map, robot->model.hull);
  std::string words = report.nearest_tag ? describe_too_near(*report.nearest_tag) : std::string();
  if (!words.empty()) report.warnings.push_back(std::move(words));
}

/// Records the source of the odometry, and warns if there is none.
void name_odometry(const RecordedLap& recorded, MapReport& report) {
  if (!recorded.odometry.empty()) {
    report.odometry = recorded.setup.chosen.odometry;
  } else if (!affects(recorded.other_clock, StampedKind::Odometry)) {
    report.warnings.emplace_back(
        "the recording contains no odometry: the trajectory and the route are estimated from tags alone");
  }
}

/// Applies the robot file. It overrides the recording, and is copied to the map folder later.
Status use_robot(const MapJob& job, RecordedLap& recorded, MapReport& report) {
  if (job.robot.empty()) return {};
  if (Status status = take_robot(job.robot, recorded.setup, report.warnings); !status) return status;
  const auto path = find_shared("robots", job.robot, "robot");
  if (!path) return tl::unexpected(path.error());
  constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20U;
  const Result<std::string> text = read_text_file(*path, kMaxFileBytes);
  if (!text) return tl::unexpected(text.error());
  recorded.attachments["robot.yaml"] = *text;
  return {};
}

}  // namespace

Status check(const MapJob& job) { return check_extension(job); }

Result<MapReport> map_recording(const MapJob& job, const JobControl& control) {
  if (Status sound = check(job); !sound) return tl::unexpected(sound.error());
  const MapProgress progress = [&](const std::string& stage, int iteration, double cost) {
    control.progress({fmt::format("{}: step {}, cost {:.0f}", stage, iteration, cost)});
    return !control.cancelled();
  };
  const Stopwatch watch;
  if (Status status = check_output_folder(job.folder); !status) return tl::unexpected(status.error());
  std::vector<std::string> files{job.lap};
  files.insert(files.end(), job.more.begin(), job.more.end());
  Result<RecordedLap> recorded = read_lap_files(files, control, job.finder, job.frames);
  const auto in_recording = [&](Error error) {
    if (error.place.source.empty() && error.place.key.empty()) error.place.source = job.lap;
    return tl::unexpected(std::move(error));
  };
  if (!recorded) return in_recording(recorded.error());
  MapReport report{.extends = job.extend.has_value()};
  if (Status status = use_robot(job, *recorded, report); !status) return in_recording(status.error());
  const RecordingSketch content = sketch_of(fs::path(job.lap).filename().string(), recorded->frames);
  Result<MapFile> map = map_corners_or_poses(*recorded, job, progress, report);
  if (control.cancelled())
    return fail(ErrorCode::Unwritable, "stopped before the map was finished: nothing was written",
                {.source = job.folder.string()});
  if (!map) return in_recording(map.error());
  std::vector<std::string> warnings;
  for (const Error& problem : recorded->setup.problems) warnings.push_back(to_string(problem));
  warnings.insert(warnings.end(), report.lap.warnings.begin(), report.lap.warnings.end());
  report.warnings.insert(report.warnings.begin(), warnings.begin(), warnings.end());
  note_content(job, content, *map, report);
  name_odometry(*recorded, report);
  check_clearance(*recorded, report);
  warn_of_size(job, report);
  if (Status status = compare_with_prior(job, report); !status) return tl::unexpected(status.error());
  if (Status status = write_map_folder(*recorded, job, *map, watch, report); !status)
    return tl::unexpected(status.error());
  return report;
}

// The report as fields.
namespace {

/// For each tag with rejected observations, the number of observations used and the numbers rejected by
/// reason, such as "tag36h11:7": {"used": 76, "elsewhere": 12, "inexact_corners": 2}.
ReportFields rejected_by_tag(const BundleFigures& bundle, const std::map<TagId, int>& used) {
  ReportFields by_tag;
  for (const auto& [tag, counts] : bundle.left_out) {
    const auto in_use = used.find(tag);
    ReportFields of_tag = {{"used", "Observations in use", in_use == used.end() ? 0 : in_use->second}};
    for (std::size_t i = 0; i < counts.size(); ++i) {
      if (counts[i] > 0)
        of_tag.push_back({to_string(static_cast<RejectionReason>(i)), "Rejected observations", counts[i]});
    }
    by_tag.push_back({to_string(tag), "Observations of this tag", of_tag});
  }
  return by_tag;
}

/// One of the six coordinates of a camera mounting.
struct MountingOffset {
  double off = 0;
  double sigma = 0;
  bool observable = false;
};

ReportFields fields(const MountingOffset& offset) {
  return {{"off", "Estimate minus the value in the robot file", offset.off},
          {"sigma", "Standard deviation of the estimate", offset.sigma},
          {"observable", "Whether the lap determines this value", offset.observable}};
}

struct MountingOffsets {
  bool used = false;
  /// Translations along, then rotations about, the x, y and z axes of the base.
  std::array<MountingOffset, 6> offsets{};
};

ReportFields fields(const MountingOffsets& mounting) {
  const auto& [x, y, z, roll, pitch, yaw] = mounting.offsets;
  return {{"used", "Whether the map and robot.yaml use this mounting", mounting.used},
          {"x_m", "Along x of the base", x},
          {"y_m", "Along y of the base", y},
          {"z_m", "Along z of the base", z},
          {"roll_deg", "About x of the base", roll},
          {"pitch_deg", "About y of the base", pitch},
          {"yaw_deg", "About z of the base", yaw}};
}

std::optional<MountingOffsets> mounting_offsets(const std::optional<BundleFigures>& bundle) {
  if (!bundle || !bundle->mounting) return std::nullopt;
  MountingOffsets mounting{.used = bundle->mounting_used};
  for (int i = 0; i < 6; ++i) {
    const double unit = i < 3 ? 1 : to_degrees(1);
    const auto at = static_cast<std::size_t>(i);
    mounting.offsets[at] = {.off = unit * bundle->mounting->off[i],
                            .sigma = unit * bundle->mounting->sigma[i],
                            .observable = !bundle->mounting->unobservable[at]};
  }
  return mounting;
}

}  // namespace

ReportFields fields(const LoopClosure& loop) {
  return {{"tag", "Family and id", to_string(loop.tag)},
          {"away_s", "Time out of view", loop.away_s},
          {"way_m", "Distance driven while the tag was out of view", loop.way_m},
          {"before_m", "Position error of the wheel odometry alone over this distance", loop.before_m},
          {"before_deg", "Heading error of the wheel odometry alone over this distance",
           to_degrees(loop.before_rad)},
          {"after_m", "Distance between the tag's positions before and after, in the adjusted map",
           loop.after_m}};
}

ReportFields fields(const MapReport& report) {
  const MappedLap& lap = report.lap;
  const std::optional<BundleFigures>& bundle = lap.bundle;
  const std::optional<OdometryScales> scales = report.poses ? part(report.poses, &PoseLapFigures::scales)
                                                            : part(bundle, &BundleFigures::odometry_scales);
  const std::optional<SE2> camera_off = part(report.poses, &PoseLapFigures::base_X_assumed);
  const std::optional<TagMapErrors>& tags = report.tag_errors;
  const std::optional<TrajectoryErrors>& path = report.trajectory_errors;
  return {
      {"method", "Mapping method: bundle, chain or poses", report.method},
      {"tags", "Tags in the map", lap.map.tags.size()},
      {"frames", "Number of frames in the lap", lap.frames},
      {"frames_without_pose", "Number of frames without a reliable tag", lap.frames_without_pose},
      {"route_length_m", "Length of the route", lap.route.length_m},
      {"route_closed", "Whether the route is closed", lap.route.closed},
      {"route_repeated_m",
       "Length of the lap beyond the closing point, where it repeats the route and is cut off",
       lap.route_repeated_m},
      {"route_clearance_m",
       "Smallest distance in space from the hull to a tag along the route; null without a robot file",
       part(report.nearest_tag, &NearestTag::clearance_m)},
      {"route_sideways_deg",
       "Largest angle between heading and direction of motion along a route that moves sideways",
       if_any(part(sideways_motion(lap.route),
                   [](const SidewaysMotion& motion) { return to_degrees(std::abs(motion.angle_rad)); }))},
      {"odometry", "Source of the odometry: its topic, or /tf with its frames; empty if unknown or unused",
       report.odometry},
      {"tag_rmse_m", "Distance of tag centres from the true ones, root mean square",
       part(tags, &TagMapErrors::rmse_m)},
      {"tag_max_m", "Largest distance of a tag centre from the true one", part(tags, &TagMapErrors::max_m)},
      {"tag_orientation_rmse_deg", "Angle of tags from the true ones, root mean square",
       part(tags, &TagMapErrors::orientation_rmse_deg)},
      {"trajectory_rmse_m", "Distance of the base from the true one at the same time, root mean square",
       part(path, &TrajectoryErrors::rmse_m)},
      {"trajectory_max_m", "Largest distance of the base from the true one at the same time",
       part(path, &TrajectoryErrors::max_m)},
      {"truth_aligned",
       "Whether the true trajectory was aligned with the lap, as its frame relative to the map is unknown",
       report.truth_aligned},
      {"reprojection_rms_px", "Reprojection error of the corners, root mean square",
       part(bundle, &BundleFigures::rms_px)},
      {"corner_noise_ratio", "Corner noise relative to the detector's covariances",
       part(bundle, &BundleFigures::noise_ratio)},
      {"correlated_images", "Successive images that count as one, as corner errors are correlated",
       part(bundle, &BundleFigures::correlated_frames)},
      {"wrong_sizes", "Tags whose given size contradicts the observations; the map has the size found",
       part(bundle, &BundleFigures::wrong_sizes)},
      {"moved_tags", kMovedTagsHelp, part(bundle, &BundleFigures::moved_tags)},
      {"missing_tags", kMissingTagsHelp, part(bundle, &BundleFigures::missing_tags)},
      {"thin_cuts", kThinCutsHelp,
       part(bundle, [](const BundleFigures& b) { return named_cuts(b.thin_cuts); })},
      {"size_spread_percent", "Standard deviation of the other printed sizes, in percent of the given sizes",
       part(bundle, [](const BundleFigures& b) { return 100 * b.size_spread; })},
      {"size_scale", "Factor from the given size to the estimated size of all tags; 1 if it is not estimated",
       part(bundle, &BundleFigures::size_scale)},
      {"size_scale_sigma", "Standard deviation of this scale; 0 if it is not estimated",
       part(bundle, &BundleFigures::size_scale_sigma)},
      {"observations_rejected", "Observations rejected as outliers", part(bundle, &BundleFigures::rejected)},
      {"observations_rejected_by_tag",
       "Counts for each tag with rejected observations: used, elsewhere, other_pose, inexact_corners, "
       "no_pose",
       part(bundle, [&](const BundleFigures& b) { return rejected_by_tag(b, lap.observations); })},
      {"iterations", "Iterations of the bundle adjustment", part(bundle, &BundleFigures::iterations)},
      {"odometry_distance_scale", "Factor that corrects distances of the wheel odometry",
       part(scales, &OdometryScales::distance)},
      {"odometry_yaw_scale", "Factor that corrects turns of the wheel odometry",
       part(scales, &OdometryScales::yaw)},
      {"turns_by_gyro",
       "Whether yaw rates are taken from the gyro because those of the wheels fit the tags much worse",
       part(bundle, &BundleFigures::turns_by_gyro)},
      {"without_gyro_fraction", "Fraction of the lap without gyro data; 1 without a gyro",
       part(bundle, &BundleFigures::without_gyro_share)},
      {"sensors", kSensorsHelp, lap.sensors},
      {"wall_s", "Duration of the run", report.wall_s},
      {"peak_rss_mib", "Peak memory of the process so far", report.peak_rss_mib},
      {"warnings", "Warnings about the map, one sentence each", report.warnings},
      {"loop_closure", "Tag that was out of view for the longest distance and then observed again, if any",
       if_any(bundle ? bundle->loop : std::nullopt)},
      {"camera_mounting", "Camera mounting estimated from the lap, relative to the robot file",
       if_any(mounting_offsets(bundle))},
      {"prior_tags_agreeing", "With `prior`: tags whose position is consistent with the older map",
       if_any(report.prior_agreeing)},
      {"prior_rms_m",
       "With `prior`: distance of these tags from the older map after alignment, root mean square",
       if_any(part(report.prior_agreeing, [&](int) { return report.prior_rms_m; }))},
      {"extended_tags_agreeing", "With `extend`: tags whose position is consistent with the extended map",
       if_any(report.extends ? part(bundle, &BundleFigures::prior_agreeing) : std::nullopt)},
      {"camera_off_m", "Recordings of tag poses only: x and y of the camera relative to the assumed position",
       if_any(part(camera_off,
                   [](const SE2& off) {
                     return std::array{off.x(), off.y()};
                   }))},
      {"camera_off_deg", "Recordings of tag poses only: yaw of the camera relative to the assumed yaw",
       if_any(part(camera_off, [](const SE2& off) { return to_degrees(off.yaw()); }))},
      {"observation_rms_m", "Recordings of tag poses only: residual of an observation, root mean square",
       if_any(part(report.poses, &PoseLapFigures::rms_m))}};
}

// The report as text.
namespace {

/// States what fraction of the lap has no gyro data. Empty if the fraction is negligible, or if there is no
/// gyro.
std::string gyro_text(const BundleFigures& b) {
  constexpr double kMinReportedShare = 0.005;
  if (b.without_gyro_share < kMinReportedShare || b.without_gyro_share == 1) return {};
  const char* what = b.turns_by_gyro ? "yaw rates there come from the wheels, with a separate scale"
                                     : "yaw rates come from the odometry throughout";
  return fmt::format("no gyro data for {:.0f} % of the lap: {}\n", 100 * b.without_gyro_share, what);
}

/// States how much of the lap repeats the route. Empty if this is no longer than the usual overlap.
std::string repetition_text(const MappedLap& lap) {
  if (lap.route_repeated_m <= kUsualOverlap_m) return {};
  return fmt::format("the last {:.2f} m of the lap repeat the route and are not part of it\n",
                     lap.route_repeated_m);
}

}  // namespace

std::string to_text(const MapReport& report, const std::string& folder) {
  const MappedLap& lap = report.lap;
  std::string text = fmt::format("{}: {} tags from {} frames by method {}; {} route of {:.2f} m\n", folder,
                                 lap.map.tags.size(), lap.frames, report.method,
                                 lap.route.closed ? "closed" : "open", lap.route.length_m);
  text += repetition_text(lap);
  if (report.tag_errors) {
    const TagMapErrors& e = *report.tag_errors;
    text += fmt::format(
        "compared with the ground truth, anchored, not aligned:\n"
        "  tags        {:.3f} m rmse, {:.3f} m worst, {:.2f} deg rmse ({} of {})\n",
        e.rmse_m, e.max_m, e.orientation_rmse_deg, e.tags, e.tags + e.missing.size());
  }
  if (report.trajectory_errors && !report.tag_errors)
    text += report.truth_aligned
                ? "compared with the true trajectory, after alignment (pose of the anchor unknown):\n"
                : "compared with the true trajectory, not aligned:\n";
  if (report.trajectory_errors)
    text += fmt::format("  trajectory  {:.3f} m rmse, {:.3f} m worst\n", report.trajectory_errors->rmse_m,
                        report.trajectory_errors->max_m);
  if (lap.bundle) {
    const BundleFigures& b = *lap.bundle;
    text += fmt::format(
        "reprojection error {:.2f} px (rms); tags moved up to {:.3f} m from the initial estimate\n", b.rms_px,
        b.moved_m);
    if (b.odometry_scales_sigma.distance > 0)
      text += fmt::format(
          "scale of the wheel odometry: {:.4f} +- {:.4f} (distances) and {:.3f} +- {:.3f} "
          "(turns)\n",
          b.odometry_scales.distance, b.odometry_scales_sigma.distance, b.odometry_scales.yaw,
          b.odometry_scales_sigma.yaw);
    if (b.size_scale_sigma > 0)
      text += fmt::format("estimated tag size: {:.4f} +- {:.4f} times the given one\n", b.size_scale,
                          b.size_scale_sigma);
    text += gyro_text(b);
  }
  if (lap.bundle && lap.bundle->loop) {
    const LoopClosure& loop = *lap.bundle->loop;
    text += fmt::format(
        "loop closed at {} after {:.1f} m: error of wheel odometry alone {:.3f} m and {:.1f} deg; "
        "after adjustment its observations agree within {:.3f} m\n",
        to_string(loop.tag), loop.way_m, loop.before_m, to_degrees(loop.before_rad), loop.after_m);
  }
  if (report.poses) {
    const PoseLapFigures& p = *report.poses;
    text += fmt::format(
        "residual {:.3f} m (rms); scale of the wheel odometry {:.4f} +- {:.4f} (distances) and "
        "{:.3f} "
        "+- "
        "{:.3f} (turns)\n",
        p.rms_m, p.scales.distance, p.scales_sigma.distance, p.scales.yaw, p.scales_sigma.yaw);
  }
  if (report.prior_agreeing)
    text += fmt::format("{} tags are consistent with the prior map, within {:.3f} m (rms, after alignment)\n",
                        *report.prior_agreeing, report.prior_rms_m);
  if (lap.bundle && report.extends)
    text += fmt::format("{} tags are consistent with the extended map\n", lap.bundle->prior_agreeing);
  if (!report.renamed_files.empty())
    text += fmt::format("existing files were kept as backups (map.yaml as map.1.yaml or similar): {}\n",
                        fmt::join(report.renamed_files, ", "));
  return text;
}

}  // namespace waymark

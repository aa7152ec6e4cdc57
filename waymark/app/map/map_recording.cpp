#include "waymark/app/map/map_recording.hpp"

#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/robot_setup.hpp"
#include "waymark/app/common/staged_folder.hpp"
#include "waymark/app/map/map_steps.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/evaluation/alignment.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// The true trajectory in the map's frame, where nobody told how the two stand to each other.
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

/// Compares the way alone, moved onto the true one: nobody told how the two stand to each other.
void compare_aligned(const RecordedLap& recorded, MapReport& report) {
  Result<Trajectory> aligned = aligned_to(report.lap.trajectory, recorded.truth);
  if (!aligned) {
    report.warnings.push_back(
        fmt::format("the true trajectory is not compared: {}", aligned.error().message));
    return;
  }
  report.true_path = std::move(*aligned);
  report.truth_aligned = true;
  report.trajectory_errors = trajectory_errors(report.lap.trajectory, report.true_path);
}

/// Compares with what is known of the truth. Where the anchor's pose was told, nothing is aligned, so the map
/// must stand where the truth does.
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
  if (true_anchor != nullptr && !in_frame_of_truth(setup.map_T_anchor, true_anchor->map_T_tag)) {
    report.warnings.emplace_back("the anchor does not stand where the truth has it: not compared");
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

Result<MapFile> map_corners(const RecordedLap& recorded, const MapJob& job, const SetupOverrides& overrides,
                            const MapLapOptions& options, const MapProgress& progress, MapReport& report) {
  Result<TeachSetup> setup = setup_of(recorded, overrides);
  if (!setup) return tl::unexpected(setup.error());
  if (options.prior) {
    for (const auto& [tag, mapped] : options.prior->map.tags) setup->sizes.size_by_tag_m[tag] = mapped.size_m;
  }
  Result<MappedLap> lap =
      map_lap({recorded.frames, recorded.odometry, recorded.imu}, *setup, options, progress);
  if (!lap) return tl::unexpected(lap.error());
  report.method = to_string(options.method);
  report.lap = std::move(*lap);
  if (Status status = compare_with_truth(recorded, job, *setup, report); !status)
    return tl::unexpected(status.error());
  return map_file_of(job, setup->anchor, report.lap);
}

/// Poses of tags, where there are no corners.
Result<MapFile> map_anything(RecordedLap& recorded, const MapJob& job, const MapProgress& progress,
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

/// What a lap says counts once. Names are all a map knows of the recordings it was made of.
void doubt_repetition(const MapJob& job, MapReport& report) {
  if (!job.extend) return;
  const std::string name = std::filesystem::path(job.lap).filename().string();
  for (const auto& [key, words] : job.extend->provenance) {
    if ((key != "recording" && key != "extends") ||
        (", " + words + ",").find(", " + name + ",") == std::string::npos)
      continue;
    report.warnings.push_back(
        fmt::format("the map that is extended was made of a {} already: if it is the same recording, what it "
                    "says counts twice, and the map calls itself surer than it is",
                    name));
    return;
  }
}

/// The tags of a map that is extended keep the size it gives them.
void tell_of_size(const MapJob& job, MapReport& report) {
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
      fmt::format("--tag-size-m {} is taken for tags that the map does not have: {} of it keep the size it "
                  "says ({} m). Where that is wrong, correct size_m in the map, or map the lap anew",
                  asked, others, known));
}

/// What --robot says goes before the recording, and into the map's folder.
Status use_robot(const MapJob& job, RecordedLap& recorded, MapReport& report) {
  if (job.robot.empty()) return {};
  if (Status status = take_robot(job.robot, recorded.setup, report.warnings); !status) return status;
  const auto path = find_shared("robots", job.robot);
  if (!path) return tl::unexpected(path.error());
  constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
  const Result<std::string> text = read_text_file(*path, kMostBytes);
  if (!text) return tl::unexpected(text.error());
  recorded.attachments["robot.yaml"] = *text;
  return {};
}

}  // namespace

Result<MapReport> map_recording(const MapJob& job, const JobControl& control) {
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
  const Result<MapFile> map = map_anything(*recorded, job, progress, report);
  if (control.cancelled())
    return fail(ErrorCode::Unwritable, "stopped before the map was finished: nothing was written",
                {.source = job.folder.string()});
  if (!map) return in_recording(map.error());
  std::vector<std::string> words;
  for (const Error& problem : recorded->setup.problems) words.push_back(to_string(problem));
  words.insert(words.end(), report.lap.warnings.begin(), report.lap.warnings.end());
  report.warnings.insert(report.warnings.begin(), words.begin(), words.end());
  doubt_repetition(job, report);
  tell_of_size(job, report);
  compare_with_prior(job, report);
  if (Status status = write_map_folder(*recorded, job, *map, watch, report); !status)
    return tl::unexpected(status.error());
  return report;
}

namespace {

/// {"tag36h11:7": {"used": 76, "elsewhere": 12, "inexact_corners": 2}}, of the tags that lost observations.
nlohmann::ordered_json by_tag_and_reason(const BundleFigures& bundle, const std::map<TagId, int>& used) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const auto& [tag, counts] : bundle.left_out) {
    nlohmann::ordered_json& of_tag = json[to_string(tag)];
    const auto in_use = used.find(tag);
    of_tag["used"] = in_use == used.end() ? 0 : in_use->second;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      if (counts[i] > 0) of_tag[to_string(static_cast<LeftOutReason>(i))] = counts[i];
    }
  }
  return json;
}

/// Where the camera sits, less what the robot's file says of it: along x, y, z of the base and about them.
nlohmann::ordered_json mounting_json(const BundleFigures& bundle) {
  nlohmann::ordered_json json = {{"used", bundle.mounting_used}};
  const std::array<const char*, 6> names = {"x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "yaw_deg"};
  for (int i = 0; i < 6; ++i) {
    const double unit = i < 3 ? 1 : to_degrees(1);
    const auto at = static_cast<std::size_t>(i);
    json[names[at]] = {{"off", unit * bundle.mounting->off[i]},
                       {"sigma", unit * bundle.mounting->sigma[i]},
                       {"told", !bundle.mounting->untold[at]}};
  }
  return json;
}

}  // namespace

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
  nlohmann::ordered_json json = {
      {"method", report.method},
      {"tags", lap.map.tags.size()},
      {"frames", lap.frames},
      {"frames_without_pose", lap.frames_without_pose},
      {"route_length_m", lap.route.length_m},
      {"route_closed", lap.route.closed},
      {"route_repeated_m", lap.route_repeated_m},
      {"tag_rmse_m", number(report.tag_errors, &TagMapErrors::rmse_m)},
      {"tag_max_m", number(report.tag_errors, &TagMapErrors::max_m)},
      {"tag_orientation_rmse_deg", number(report.tag_errors, &TagMapErrors::orientation_rmse_deg)},
      {"trajectory_rmse_m", number(report.trajectory_errors, &TrajectoryErrors::rmse_m)},
      {"trajectory_max_m", number(report.trajectory_errors, &TrajectoryErrors::max_m)},
      {"truth_aligned", report.truth_aligned},
      {"reprojection_rms_px", of_bundle([](const BundleFigures& b) { return b.rms_px; })},
      {"corner_noise_ratio", of_bundle([](const BundleFigures& b) { return b.noise_ratio; })},
      {"correlated_pictures", of_bundle([](const BundleFigures& b) { return b.correlated_frames; })},
      {"observations_rejected", of_bundle([](const BundleFigures& b) { return b.rejected; })},
      {"observations_rejected_by_tag",
       of_bundle([&](const BundleFigures& b) { return by_tag_and_reason(b, lap.observations); })},
      {"iterations", of_bundle([](const BundleFigures& b) { return b.iterations; })},
      {"odometry_distance_scale",
       of_bundle([](const BundleFigures& b) { return b.odometry_scales.distance; })},
      {"odometry_yaw_scale", of_bundle([](const BundleFigures& b) { return b.odometry_scales.yaw; })},
      {"turns_by_gyro", of_bundle([](const BundleFigures& b) { return b.turns_by_gyro; })},
      {"without_gyro_fraction", of_bundle([](const BundleFigures& b) { return b.without_gyro_share; })},
      {"wall_s", report.wall_s},
      {"peak_rss_mib", report.peak_rss_mib},
      {"warnings", report.warnings}};
  if (lap.bundle && lap.bundle->loop) {
    const LoopClosure& loop = *lap.bundle->loop;
    json["loop_closure"] = {{"tag", to_string(loop.tag)},
                            {"away_s", loop.away_s},
                            {"way_m", loop.way_m},
                            {"before_m", loop.before_m},
                            {"before_deg", to_degrees(loop.before_rad)},
                            {"after_m", loop.after_m}};
  }
  if (lap.bundle && lap.bundle->mounting) json["camera_mounting"] = mounting_json(*lap.bundle);
  if (report.prior_agreeing) {
    json["prior_tags_agreeing"] = *report.prior_agreeing;
    json["prior_rms_m"] = report.prior_rms_m;
  }
  if (report.lap.bundle && report.extends) json["extended_tags_agreeing"] = report.lap.bundle->prior_agreeing;
  if (report.poses) {
    const PoseLapFigures& p = *report.poses;
    json["odometry_distance_scale"] = p.scales.distance;
    json["odometry_yaw_scale"] = p.scales.yaw;
    json["camera_off_m"] = {p.base_X_assumed.x(), p.base_X_assumed.y()};
    json["camera_off_deg"] = to_degrees(p.base_X_assumed.yaw());
    json["observation_rms_m"] = p.rms_m;
  }
  return json;
}

}  // namespace waymark

#include "waymark/app/scene/map_scene.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/detect_all.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/common/route_files.hpp"
#include "waymark/app/scene/scene_recording.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/tagslam.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/mapping/scene/moved_tags.hpp"
#include "waymark/mapping/scene/scene_report.hpp"

namespace waymark {
namespace {

/// A list such as "3, 4, 7", with at most twelve entries.
std::string number_list(const std::vector<TagId>& tags) {
  std::vector<std::string> numbers;
  constexpr std::size_t kMaxListed = 12;
  numbers.reserve(tags.size());
  for (const TagId& tag : tags) numbers.push_back(std::to_string(tag.number));
  const std::size_t all = numbers.size();
  if (all > kMaxListed) numbers.resize(kMaxListed);
  return fmt::format("{}{}", fmt::join(numbers, ", "),
                     all > kMaxListed ? fmt::format(" and {} more", all - kMaxListed) : "");
}

/// Limits a covariance to that of an unknown pose. The sum of the covariances of a body and of a tag on it
/// may be larger, and map readers reject implausibly large values.
Matrix6 at_most_unknown(const Matrix6& P) {
  constexpr double kUnknown = 1e6;
  const double largest = P.diagonal().maxCoeff();
  return largest > kUnknown ? Matrix6(P * (kUnknown / largest)) : P;
}

MapFile map_file(const MapSceneJob& job, const SceneMap& map) {
  MapFile file{.provenance = {{"method", "bundle"},
                              {"recording", std::filesystem::path(job.recording).filename().string()}}};
  int most = -1;
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    const SceneBody& body = map.scene.bodies[b];
    for (std::size_t t = 0; t < body.tags.size(); ++t) {
      const auto pose = map.map_T_tag(b, t);
      const PoseIndex of_tag = map.problem.tags[b][t];
      const auto observations =
          static_cast<int>(std::ranges::count_if(map.problem.bundle.corners, [&](const CornerTerm& term) {
            return term.used && term.tag == of_tag;
          }));
      if (!pose || observations == 0) continue;
      const PoseIndex of_body = map.problem.bodies[b].front();
      const Matrix6 Ad = map.problem.bundle.poses[of_body].value.adjoint();
      file.tags.tags[body.tags[t].id] = {*pose, body.tags[t].size_m,
                                         at_most_unknown(map.covariance.poses[of_body] +
                                                         Ad * map.covariance.poses[of_tag] * Ad.transpose())};
      file.observations[body.tags[t].id] = observations;
      const bool given = map.problem.bundle.poses[of_tag].fixed || body.tags[t].body_T_tag.has_value();
      const bool known = given && find_moved(map, body.tags[t].id) == nullptr;
      const int merit = observations + (known ? 1'000'000'000 : 0);
      if (merit > most) file.anchor = body.tags[t].id;
      most = std::max(most, merit);
    }
  }
  return file;
}

Trajectory trajectory_of(const SceneRecording& recording, const SceneMap& map, std::size_t body) {
  std::vector<char> tied(map.problem.bundle.poses.size(), 0);
  for (const CornerTerm& term : map.problem.bundle.corners) {
    if (term.used) tied[term.rig] = tied[term.body] = 1;
  }
  for (const RelativeTerm& term : map.problem.bundle.relatives) {
    if (term.used) tied[term.a] = tied[term.b] = 1;
  }
  Trajectory trajectory;
  for (std::size_t f = 0; f < recording.frames.size(); ++f) {
    const PoseIndex pose = map.problem.bodies[body][f];
    if (map.placed[pose] != 0 && tied[pose] != 0)
      trajectory.push_back({recording.frames[f].stamp, map.problem.bundle.poses[pose].value});
  }
  return trajectory;
}

/// Writes to a temporary folder, but reports the final paths.
Status write_scene(const MapSceneJob& job, const SceneRecording& recording,
                   const std::filesystem::path& folder, MapSceneReport& report) {
  const auto write = [&](const std::string& name, const std::string& text) -> Status {
    Status status = write_text_file(folder / name, text);
    if (status) report.files.push_back((job.folder / name).string());
    return status;
  };
  Status status;
  const MapFile file = map_file(job, report.map);
  if (!file.tags.tags.empty()) {
    status = write_map(folder / "map.yaml", file);
    if (status) report.files.push_back((job.folder / "map.yaml").string());
  }
  if (status) status = write("poses.yaml", to_tagslam_poses(report.map));
  if (status) status = write("camera_poses.yaml", to_tagslam_camera_poses(report.map));
  std::vector<char> somewhere(recording.frames.size(), 0);
  for (std::size_t b = 0; status && b < report.map.scene.bodies.size(); ++b) {
    if (report.map.scene.bodies[b].is_static) continue;
    const Trajectory trajectory = trajectory_of(recording, report.map, b);
    report.frames_without_pose =
        std::max(report.frames_without_pose, static_cast<int>(recording.frames.size() - trajectory.size()));
    std::string name = report.map.scene.bodies[b].name;
    std::ranges::replace(name, '/', '_');
    status = write("trajectory_" + name + ".txt", to_tum(trajectory));
  }
  return status;
}

Status write_scene_folder(const MapSceneJob& job, const SceneRecording& recording, const Stopwatch& watch,
                          MapSceneReport& report) {
  Result<StagedFolder> staged = StagedFolder::open(job.folder);
  if (!staged) return tl::unexpected(staged.error());
  Status status = write_scene(job, recording, staged->path(), report);
  if (!status) return staged->failed(status.error());
  report.wall_s = watch.seconds();
  report.peak_rss_mib = peak_rss_mib();
  report.files.push_back((job.folder / "summary.json").string());
  status = write_text_file(staged->path() / "summary.json", json_text(fields(report)));
  if (!status) return staged->failed(status.error());
  // Empty unless the folder contains a map made from a lap.
  std::vector<std::string> routes = route_names(job.folder);
  routes.emplace_back();
  const auto backups = staged->put_in_place(files_of_map(routes));
  return backups ? Status() : tl::unexpected(backups.error());
}

std::vector<TagId> keys_of(const std::map<TagId, int>& counts) {
  std::vector<TagId> tags;
  tags.reserve(counts.size());
  for (const auto& [tag, count] : counts) tags.push_back(tag);
  return tags;
}

/// Observed tags that belong to no body.
std::vector<TagId> foreign_tags(const SceneMap& map) { return keys_of(map.observations.foreign); }

void warn(MapSceneReport& report) {
  const SceneMap& map = report.map;
  for (const std::vector<TagId>& group : map.unconnected) {
    const bool tied = std::ranges::any_of(map.left_out_cuts, [&](const TagCut& cut) {
      return cut.beyond == group;
    });  // reported by scene_warnings()
    if (tied) continue;
    report.warnings.push_back(
        fmt::format("omitted tag{} {}, which {} never observed together with a tag connected to the map",
                    group.size() > 1 ? "s" : "", number_list(group), group.size() > 1 ? "were" : "was"));
  }
  for (std::string& warning : scene_warnings(map)) report.warnings.push_back(std::move(warning));
  if (!map.rejected_tags.empty())
    report.warnings.push_back(fmt::format("omitted unlisted ids with few or inconsistent observations: {}",
                                          number_list(map.rejected_tags)));
  const std::vector<TagId> foreign = foreign_tags(map);
  if (!foreign.empty())
    report.warnings.push_back(
        fmt::format("ignored {} ids that belong to no body: {}", foreign.size(), number_list(foreign)));
  if (map.observations.unreliable > 0)
    report.warnings.push_back(unreliable_note(static_cast<std::size_t>(map.observations.unreliable)));
  if (!map.rejected.empty())
    report.warnings.push_back(fmt::format("rejected {} of {} observations as outliers", map.rejected.size(),
                                          map.observations.seen.size()));
  for (std::size_t c = 0; c < map.scene.cameras.size(); ++c) {
    if (map.placed[map.problem.cameras[c]] == 0)
      report.warnings.push_back(map.scene.cameras[c].name +
                                ": no observation determines the pose of this camera");
  }
}

/// Estimated intrinsics by camera and parameter, with standard deviations and the given values. Empty if the
/// intrinsics are fixed.
std::optional<ReportFields> intrinsics_fields(const SceneMap& map) {
  if (map.intrinsics.empty()) return std::nullopt;
  ReportFields by_camera;
  for (const FoundIntrinsics& lens : map.intrinsics) {
    ReportFields by_name;
    for (Eigen::Index i = 0; i < lens.found.size(); ++i)
      by_name.push_back({lens.names[static_cast<std::size_t>(i)], "Parameter of the camera",
                         ReportFields{{"value", "Estimated value", lens.found[i]},
                                      {"sigma", "Standard deviation of the estimate", lens.sigma[i]},
                                      {"given", "Value in the files", lens.given[i]}}});
    by_camera.push_back({map.scene.cameras[lens.camera].name, "Parameters of this camera", by_name});
  }
  return by_camera;
}

std::size_t tags_in_map(const SceneMap& map) {
  std::set<TagId> seen;
  std::size_t tags = 0;
  for (const SceneObservation& observation : map.observations.seen) {
    const SceneTag& tag = map.scene.bodies[observation.body].tags[observation.tag];
    if (seen.insert(tag.id).second && map.placed[map.problem.tags[observation.body][observation.tag]] != 0)
      ++tags;
  }
  return tags;
}

std::vector<int> numbers_of(const std::vector<TagId>& tags) {
  std::vector<int> numbers;
  numbers.reserve(tags.size());
  for (const TagId& tag : tags) numbers.push_back(tag.number);
  return numbers;
}

}  // namespace

Result<SceneModel> parse_scene_model(const std::string& name) {
  if (name == "waymark") return SceneModel::Waymark;
  if (name == "tagslam") return SceneModel::Tagslam;
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown model '{}'", name), {.key = "model"},
              suggestion(name, {"waymark", "tagslam"}));
}

Status check(const MapSceneJob& job) {
  if (job.options.model != SceneModel::Tagslam) return {};
  if (job.options.free_intrinsics)
    return fail(ErrorCode::InvalidArgument, "in TagSLAM's model the intrinsics are fixed",
                {.key = "free_intrinsics"}, "Omit `free_intrinsics` or `model=tagslam`.");
  const auto refuse_sigma = [](const std::string& key) {
    return fail(ErrorCode::InvalidArgument, "in TagSLAM's model the sizes of tags are exact", {.key = key},
                "Omit `" + key + "` or `model=tagslam`.");
  };
  if (job.options.search.tag_size_sigma_percent != SearchOptions().tag_size_sigma_percent)
    return refuse_sigma("tag_size_sigma_percent");
  if (job.options.search.common_tag_size_sigma_percent) return refuse_sigma("common_tag_size_sigma_percent");
  return {};
}

Result<MapSceneReport> map_scene_recording(const MapSceneJob& job, const JobControl& control) {
  const Stopwatch watch;
  if (Status status = check_output_folder(job.folder); !status) return tl::unexpected(status.error());
  Result<TagScene> scene =
      or_wrong_kind(read_tagslam_folder(job.tagslam), job.tagslam, FileUse::TagslamFolder);
  if (!scene) return tl::unexpected(scene.error());
  MapSceneReport report;
  Result<SceneRecording> recording = read_scene_recording(job.recording, *scene, control, report.warnings);
  if (!recording) return tl::unexpected(recording.error());
  unify_family(*scene, *recording);
  recording->nearest_odometry = job.options.model == SceneModel::Tagslam;
  std::optional<SceneValues> values;
  if (!job.against.empty()) {
    Result<SceneValues> read = read_scene_values(job.against, *scene);
    if (!read) return tl::unexpected(read.error());
    values = std::move(*read);
    restrict_to(*values, *recording);
  }
  const MapProgress progress = [&](const std::string& stage, int iteration, double cost) {
    control.progress({fmt::format("{}: step {}, cost {:.0f}", stage, iteration, cost)});
    return !control.cancelled();
  };
  Result<SceneMap> map = map_scene(*scene, *recording, job.options, progress);
  if (control.cancelled())
    return fail(ErrorCode::Unwritable, "stopped before the map was finished: nothing was written",
                {.source = job.folder.string()});
  if (!map) return tl::unexpected(map.error());
  report.map = std::move(*map);
  report.frames = static_cast<int>(recording->frames.size());
  warn(report);
  if (values) {
    Result<CostAtValues> cost = cost_at(*values, *scene, *recording, job.options);
    if (!cost) return tl::unexpected(cost.error());
    report.against = *cost;
  }
  if (Status status = write_scene_folder(job, *recording, watch, report); !status)
    return tl::unexpected(status.error());
  return report;
}

ReportFields fields(const OdometryLink& link) {
  return {{"ids", "Tags of this group", numbers_of(link.beyond)},
          {"length_m", "Length of the shortest connection", link.length_m},
          {"frames", "Number of steps of odometry in it", link.frames}};
}

ReportFields fields(const RejectedOdometry& rejected) {
  return {{"from_s", "Start, since the first frame", rejected.from_s},
          {"to_s", "End", rejected.to_s},
          {"off_m", "Difference between the odometry and the map", rejected.off_m},
          {"off_deg", "Difference between their rotations", to_degrees(rejected.off_rad)},
          {"chi2", "Squared normalised difference, with 6 degrees of freedom", rejected.chi2}};
}

ReportFields fields(const CostAtValues& cost) {
  return {
      {"cost", "Cost of the other solution in TagSLAM's model", cost.cost},
      {"free_poses", "Number of poses missing from the other solution; they are chosen to minimise the cost",
       cost.free_poses},
      {"reprojection_mean_px", "Mean reprojection error of the corners", cost.reprojection_mean_px},
      {"reprojection_median_px", "Median reprojection error of the corners", cost.reprojection_median_px}};
}

ReportFields fields(const MapSceneReport& report) {
  const SceneMap& map = report.map;
  std::vector<std::vector<int>> unconnected;
  unconnected.reserve(map.unconnected.size());
  for (const std::vector<TagId>& group : map.unconnected) unconnected.push_back(numbers_of(group));
  return {
      {"frames", "Number of frames in the recording", report.frames},
      {"frames_without_pose",
       "Number of frames without a pose, for the moving body with the most such frames",
       report.frames_without_pose},
      {"observations", "Number of tag observations", map.observations.seen.size()},
      {"tags", "Number of tags in the map", tags_in_map(map)},
      {"rejected_observations", "Number of observations rejected as outliers", map.rejected.size()},
      {"unreliable_observations", "Further observations, with unreliable corners",
       map.observations.unreliable},
      {"foreign_ids", "Ids that belong to no body", numbers_of(foreign_tags(map))},
      {"rejected_tag_ids", "Unlisted ids with few or inconsistent observations",
       numbers_of(map.rejected_tags)},
      {"unconnected_ids", "Groups of ids without a connection to the map", unconnected},
      {"undetermined_ids", "Ids whose pose is not determined; their covariance is that of an unknown pose",
       numbers_of(map.undetermined)},
      {"prior_only_ids", "Ids that only their given pose places; no observation connects them to other tags",
       numbers_of(keys_of(map.prior_only))},
      {"thin_cuts", kThinCutsHelp, map.thin_cuts},
      {"left_out_cuts",
       "Parts that are not connected, because the observations that would connect them are unconfirmed",
       map.left_out_cuts},
      {"odometry_links", "Groups of tags that odometry alone connects to the others, largest first",
       map.odometry_links},
      {"rejected_odometry",
       "Odometry that contradicts the observations and is not used, with the largest contradiction first",
       map.rejected_odometry},
      {"odometry_noise_ratio", "Estimated noise of odometry relative to the given noise, at least 1",
       map.odometry_ratio},
      {"wrong_sizes", "Tags whose given size contradicts the observations; the map has the size found",
       map.wrong_sizes},
      {"moved_tags", kMovedTagsHelp, map.moved_tags},
      {"missing_tags", kMissingTagsHelp, map.missing_tags},
      {"duplicate_ids", kDuplicateIdsHelp, map.duplicate_tags},
      {"size_spread_percent", "Standard deviation of the other printed sizes, in percent of the given sizes",
       100 * map.size_spread},
      {"correlated_images", "Number of images that count as one, because their corner errors are correlated",
       map.correlated_frames},
      {"size_scale", "Factor from the given size to the estimated size of all tags; 1 if it is not estimated",
       map.size_scale},
      {"size_scale_sigma", "Standard deviation of this scale; 0 if it is not estimated", map.size_sigma},
      {"noise_px", "Standard deviation of a corner coordinate", map.noise_px},
      {"reprojection_mean_px", "Mean reprojection error of the corners in use", map.reprojection_mean_px},
      {"reprojection_median_px", "Median reprojection error of the corners in use",
       map.reprojection_median_px},
      {"cost", "Half the sum of squared residuals, weighted by the noise of the model", map.cost},
      {"iterations", "Iterations of the bundle adjustment", map.summary.iterations},
      {"files", "Files that were written", report.files},
      {"wall_s", "Duration of the run", report.wall_s},
      {"peak_rss_mib", "Peak memory of the process so far", report.peak_rss_mib},
      {"warnings", "Warnings about the map, one sentence each", report.warnings},
      {"intrinsics", "With `free_intrinsics`, by camera and parameter: value, sigma, given",
       if_any(intrinsics_fields(map))},
      {"against", "With `against`: the other solution", if_any(report.against)}};
}

std::string to_text(const MapSceneReport& report, const std::string& folder) {
  std::string text = fmt::format("{}: {} tags from {} observations in {} frames\n", folder,
                                 tags_in_map(report.map), report.map.observations.seen.size(), report.frames);
  text += fmt::format("reprojection error {:.3f} px (mean; median {:.3f}), noise {:.3f} px, cost {:.2f}\n",
                      report.map.reprojection_mean_px, report.map.reprojection_median_px, report.map.noise_px,
                      report.map.cost);
  if (report.against)
    text += fmt::format(
        "cost of the other solution {:.2f} in TagSLAM's model; the cost of this map differs by {:+.2f} % "
        "(compare with `model=tagslam`)\n",
        report.against->cost, 100 * (report.map.cost / report.against->cost - 1));
  return text;
}

}  // namespace waymark

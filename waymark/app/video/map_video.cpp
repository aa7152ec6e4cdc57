#include "waymark/app/video/map_video.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/common/route_files.hpp"
#include "waymark/app/common/thin_cut_fields.hpp"
#include "waymark/app/video/video_scene.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/field_layouts.hpp"
#include "waymark/config/exchange/landmarks_file.hpp"
#include "waymark/config/exchange/tagslam.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/mapping/lap/map_comparison.hpp"
#include "waymark/mapping/scene/moved_tags.hpp"
#include "waymark/mapping/scene/scene_report.hpp"

namespace waymark {
namespace {

using internal::kHand;
using internal::kWalls;
using internal::VideoAnchors;

std::map<TagId, int> count_tags(const std::vector<SceneFrame>& frames) {
  std::map<TagId, int> count;
  for (const SceneFrame& frame : frames)
    for (const SceneView& view : frame.views)
      for (const TagDetection& detection : view.detections)
        if (usable_corners(detection)) ++count[detection.tag];
  return count;
}

/// Fails if a video is listed twice, because its images would count as independent and the covariances would
/// be too small.
Status check_videos_differ(const std::vector<std::string>& videos) {
  for (std::size_t i = 0; i < videos.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      std::error_code ignored;  // missing files are reported when they are read
      if (videos[i] == videos[k] || std::filesystem::equivalent(videos[i], videos[k], ignored))
        return fail(ErrorCode::InvalidArgument, "duplicate video", {.source = videos[i]},
                    "Give each video only once; otherwise its images would count twice, as independent "
                    "measurements.");
    }
  return {};
}

/// Detects the tags in all videos. The timestamps in each video start one second after the end of the
/// previous video.
Result<std::vector<SceneFrame>> detect_in_videos(const MapVideoJob& job, const TagFinder& finder,
                                                 const JobControl& control,
                                                 std::vector<std::string>& warnings) {
  std::vector<SceneFrame> frames;
  Duration offset{};
  for (const std::string& video : job.videos) {
    const auto add = [&](TagFrame& tags) -> Status {
      frames.push_back({tags.stamp + offset, {{0, std::move(tags.detections)}}});
      return {};
    };
    const Result<VideoTags> found = find_camera_tags(video, finder, *job.camera, control, add);
    if (!found) return tl::unexpected(found.error());
    for (const VideoProblem& problem : found->problems) warnings.push_back(to_string(problem.error));
    offset = frames.back().stamp.time_since_epoch() + std::chrono::seconds(1);
  }
  if (count_tags(frames).empty())
    return fail(ErrorCode::NotFound, "no tag was detected in any image", {.source = job.videos.front()},
                "Set the tag family with `family`; `waymark detect` shows the detections.");
  return frames;
}

/// The error if all tags were rejected from the map.
Error no_tag_left(const MapVideoJob& job, const SceneMap& map) {
  std::string message = "no tag remains in the map";
  if (!map.rejected.empty())
    message += fmt::format(": rejected {} of {} observations as outliers", map.rejected.size(),
                           map.observations.seen.size());
  const char* distances = job.distances.empty() ? "" : "the distances measured between tags (`distance`), ";
  return {ErrorCode::NotFound,
          message,
          {},
          fmt::format("Check {}the tag size and the camera calibration.", distances)};
}

/// The map file, with all tags whose poses are determined.
MapFile video_map_file(const MapVideoJob& job, const VideoAnchors& anchors, const SceneMap& map) {
  MapFile file{.anchor = anchors.first, .provenance = {{"method", "bundle"}}};
  if (!job.videos.empty())
    file.provenance.emplace_back("recording", std::filesystem::path(job.videos.front()).filename().string());
  const SceneBody& walls = map.scene.bodies[kWalls];
  for (std::size_t t = 0; t < walls.tags.size(); ++t) {
    const auto pose = map.map_T_tag(kWalls, t);
    const PoseIndex index = map.problem.tags[kWalls][t];
    const auto observations = std::ranges::count_if(
        map.problem.bundle.corners, [&](const CornerTerm& term) { return term.used && term.tag == index; });
    const TagId id = walls.tags[t].id;
    const bool known = std::ranges::find(map.undetermined, id) == map.undetermined.end();
    if (!pose || observations == 0 || !known) continue;
    const bool exact = anchors.exact.contains(id) && find_moved(map, id) == nullptr;
    const Matrix6 covariance = exact ? Matrix6(Matrix6::Zero()) : map.covariance.poses[index];
    file.tags.tags[id] = {.map_T_tag = exact ? anchors.tags.at(id).mean : *pose,
                          .size_m = walls.tags[t].size_m,
                          .covariance = covariance};
    file.observations[id] = static_cast<int>(observations);
  }
  return file;
}

/// The options of the search, with the usual error of a measured or printed size as the common one.
SearchOptions search_options(const MapVideoJob& job) {
  constexpr double kUsualSizeSigma_m = 0.0005;
  SearchOptions options = job.search;
  if (!options.common_tag_size_sigma_percent)
    options.common_tag_size_sigma_percent = 100 * kUsualSizeSigma_m / *job.sizes.default_size_m;
  return options;
}

Trajectory camera_path(const std::vector<SceneFrame>& frames, const SceneMap& map) {
  std::vector<char> seen(frames.size(), 0);
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i)
    if (map.problem.bundle.corners[i].used) seen[map.observations.seen[i].frame] = 1;
  Trajectory path;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const PoseIndex pose = map.problem.bodies[kHand][f];
    if (seen[f] != 0 && map.placed[pose] != 0)
      path.push_back({frames[f].stamp, map.problem.bundle.poses[pose].value});
  }
  return path;
}

void list_prior_differences(const TagMap& prior, const VideoAnchors& anchors, MapVideoReport& report) {
  for (const auto& [id, tag] : report.file.tags.tags) {
    const MappedTag* known = prior.find(id);
    if (known == nullptr || anchors.exact.contains(id)) continue;
    const SO3 turn = known->map_T_tag.rotation().inverse() * tag.map_T_tag.rotation();
    report.beside.push_back({.tag = id,
                             .off_m = tag.map_T_tag.translation() - known->map_T_tag.translation(),
                             .sigma_m = position_sigma_m(tag),
                             .turned_rad = turn.log().norm()});
  }
}

/// Fails if hardly any tag is at its pose in the older map, whose frame the new map would claim to have.
Status check_prior_place(const TagMap& prior, const VideoAnchors& anchors, const MapVideoReport& report) {
  constexpr double kGate = 5;
  constexpr double kMaxSame_m = 0.1;
  const auto agreeing = std::ranges::count_if(report.beside, [&](const TagBesidePrior& tag) {
    return tag.off_m.norm() <= std::max(kGate * tag.sigma_m.norm(), kMaxSame_m);
  });
  const auto exact =
      std::ranges::count_if(anchors.exact, [&](const TagId& tag) { return prior.find(tag) != nullptr; });
  const std::ptrdiff_t common = std::ssize(report.beside) + exact;
  if (!agree_by_chance(agreeing + exact, common)) return {};
  return fail(ErrorCode::NotFound,
              fmt::format("only {} of {} observed tags are at their pose in the older map: it is of another "
                          "place, or {} was moved",
                          agreeing + exact, common, to_string(anchors.first)),
              {.key = "prior"}, "Check that the video shows this place, or choose another `anchor`.");
}

void list_distances(const MapVideoJob& job, MapVideoReport& report) {
  for (const MeasuredDistance& d : job.distances) {
    const MappedTag* a = report.file.tags.find(d.a);
    const MappedTag* b = report.file.tags.find(d.b);
    if (a == nullptr || b == nullptr) {
      report.warnings.push_back(
          fmt::format("ignored the distance between {} and {}: at least one of them is not in the map",
                      to_string(d.a), to_string(d.b)));
      continue;
    }
    report.measured.push_back({d, (a->map_T_tag.translation() - b->map_T_tag.translation()).norm()});
  }
}

// Values up to 10 are normal for a compressed video and a correct calibration.
constexpr double kSuspectChi2 = 16;

void warn_of(const VideoAnchors& anchors, MapVideoReport& report) {
  const SceneMap& map = report.map;
  if (anchors.assumed && anchors.exact.contains(anchors.first))
    report.warnings.push_back(
        fmt::format("{} is assumed upright at the map origin. Set `anchor` and `anchor_pose` to define the "
                    "map frame, or `upright` and `floor` to level the map",
                    to_string(anchors.first)));
  for (const std::vector<TagId>& group : map.unconnected) {
    std::string names;
    for (const TagId& tag : group) names += (names.empty() ? "" : ", ") + std::to_string(tag.number);
    report.warnings.push_back(
        "omitted tags that were never in the same image as a tag connected to the map: " + names);
  }
  if (report.corner_chi2_per_dof > kSuspectChi2)
    report.warnings.push_back(fmt::format(
        "the residuals are {:.1f} times as large as the detector's covariances predict. Check the "
        "calibration (this camera, resolution and focus), the tags (flat, of the given size) and the video "
        "(not stabilised, not strongly compressed). The map's standard deviations are derived from the "
        "residuals and exclude errors common to all images",
        std::sqrt(report.corner_chi2_per_dof)));
  for (const FoundIntrinsics& lens : map.intrinsics)
    for (Eigen::Index i = 0; i < lens.found.size(); ++i)
      if (std::abs(lens.found[i] - lens.given[i]) > 3 * lens.prior_sigma[i])
        report.warnings.push_back(fmt::format(
            "{} is estimated as {:.5g}, {:.1f} standard deviations from its calibrated value {:.5g}; "
            "calibrate the camera again, at this resolution and focus",
            lens.names[static_cast<std::size_t>(i)], lens.found[i],
            std::abs(lens.found[i] - lens.given[i]) / lens.prior_sigma[i], lens.given[i]));
  for (std::string& warning : scene_warnings(map)) report.warnings.push_back(std::move(warning));
  if (!map.rejected.empty())
    report.warnings.push_back(fmt::format("rejected {} of {} observations as outliers", map.rejected.size(),
                                          map.observations.seen.size()));
}

Status write_all(const MapVideoJob& job, const Stopwatch& watch, MapVideoReport& report) {
  Result<StagedFolder> staged = StagedFolder::open(job.folder);
  if (!staged) return tl::unexpected(staged.error());
  const auto named = [&](const char* name) { report.files.push_back((job.folder / name).string()); };
  // Fails for tag families that FMAP does not support.
  const Result<std::string> fmap = to_fmap(report.file.tags, job.field);
  for (const char* name :
       {"map.yaml", "layout.json", "layout.fmap", "poses.yaml", "trajectory.txt", "summary.json"})
    if (fmap || name != std::string_view("layout.fmap")) named(name);
  Status status = write_map(staged->path() / "map.yaml", report.file);
  const auto write = [&](const char* name, const std::string& text) {
    if (status) status = write_text_file(staged->path() / name, text);
  };
  write("layout.json", to_wpilib_layout(report.file.tags, job.field));
  if (fmap) write("layout.fmap", *fmap);
  write("poses.yaml", to_tagslam_poses(report.map));
  write("trajectory.txt", to_tum(report.trajectory));
  report.wall_s = watch.seconds();
  write("summary.json", json_text(fields(report)));
  if (!status) return staged->failed(status.error());
  // Empty unless the folder contains a map made from a lap.
  std::vector<std::string> routes = route_names(job.folder);
  routes.emplace_back();
  const auto backups = staged->put_in_place(files_of_map(routes));
  return backups ? Status() : tl::unexpected(backups.error());
}

std::optional<double> number_in(const std::string& text) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, problem] = std::from_chars(text.data(), end, value);
  return problem == std::errc() && stop == end ? std::optional(value) : std::nullopt;
}

}  // namespace

Eigen::Vector3d position_sigma_m(const MappedTag& tag) {
  if (!tag.covariance) return Eigen::Vector3d::Zero();
  return coordinate_deviations(Uncertain<SE3>{tag.map_T_tag, *tag.covariance}).head<3>();
}

Result<MeasuredDistance> parse_distance(const std::string& text, SearchedFamilies families) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    if (end > begin) parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  const auto wrong = [&] {
    return fail(ErrorCode::InvalidArgument, fmt::format("invalid tag distance '{}'", text),
                {.key = "distance"},
                "Give two ids and metres: 3,7,2.41, or with a standard deviation 3,7,2.41,0.002.");
  };
  if (parts.size() != 3 && parts.size() != 4) return wrong();
  const Result<TagId> a = tag_named(parts[0], nullptr, families);
  const Result<TagId> b = tag_named(parts[1], nullptr, families);
  MeasuredDistance distance;
  if (!a || !b || *a == *b) return wrong();
  distance.a = *a;
  distance.b = *b;
  const auto length = number_in(parts[2]);
  const auto sigma = parts.size() == 4 ? number_in(parts[3]) : std::optional(distance.sigma_m);
  if (!length || !sigma || !(*length > 0 && *length < 1e4) || !(*sigma > 0 && *sigma < 1e3)) return wrong();
  distance.measured_m = *length;
  distance.sigma_m = *sigma;
  return distance;
}

Status read_prior_map(const std::string& file, MapVideoJob& job) {
  Result<LandmarksFile> older =
      or_wrong_kind(read_landmarks(file, job.sizes.default_size_m), file, FileUse::Map);
  if (!older) return tl::unexpected(older.error());
  job.prior = std::move(older->tags);
  job.field = older->field;
  return {};
}

Status check(const MapVideoJob& job) {
  const auto refuse = [](const char* field, const std::string& why, const char* hint) {
    return fail(ErrorCode::InvalidArgument, why, {.key = field}, hint);
  };
  for (const std::string& video : job.videos)
    if (Status of_camera = check_of_camera(
            video, "Use `waymark map lap`, without `camera`: the recording contains its camera.");
        !of_camera)
      return of_camera;
  if (!job.camera)
    return refuse("camera", "a video contains no camera calibration",
                  "Set `camera=calibration.yaml`; `waymark calibrate camera` makes this file.");
  if (!job.sizes.default_size_m)
    return refuse("tag_size_m", "a video does not specify the tag size",
                  "Measure the side of the black square, for example `tag_size_m=0.165`.");
  const bool prior_has_sigma = job.prior_sigma_m || job.prior_sigma_deg;
  if (prior_has_sigma && job.prior.tags.empty())
    return refuse(job.prior_sigma_m ? "prior_sigma_m" : "prior_sigma_deg",
                  "this option applies to the tags of an older map", "Set `prior` to that map.");
  if (job.level_sigma_deg && job.upright.empty() && job.floor.empty() && job.planes.empty())
    return refuse("level_sigma_deg", "this option applies to tags of `upright`, `floor` or `plane`",
                  "Set one of them, or omit `level_sigma_deg`.");
  if (job.map_T_anchor && (job.anchors.size() > 1 || prior_has_sigma))
    return refuse(
        "anchor_pose", "the tags of `prior` already define the map frame",
        "Omit `anchor_pose`, or give one `anchor` and neither `prior_sigma_m` nor `prior_sigma_deg`.");
  for (const TagId& tag : job.floor)
    if (std::ranges::find(job.upright, tag) != job.upright.end())
      return refuse(
          "upright",
          fmt::format("{} is also in `floor`, but a tag cannot be both on the floor and upright on a wall",
                      to_string(tag)),
          "Remove the tag from one of the two lists.");
  return {};
}

Result<MapVideoReport> map_views(const MapVideoJob& job, std::vector<SceneFrame> frames,
                                 const JobControl& control) {
  if (Status sound = check(job); !sound) return tl::unexpected(sound.error());
  MapVideoReport report{.images = frames.size()};
  const std::map<TagId, int> count = count_tags(frames);
  if (count.empty()) return fail(ErrorCode::NotFound, "the frames contain no tag detections");
  const Result<VideoAnchors> anchors = internal::video_anchors(job, count);
  if (!anchors) return tl::unexpected(anchors.error());
  const Result<TagScene> scene = internal::video_scene(job, count, *anchors);
  if (!scene) return tl::unexpected(scene.error());
  const SceneRecording recording{.frames = std::move(frames)};
  const MapProgress progress = [&](const std::string& stage, int iteration, double cost) {
    control.progress({fmt::format("{}: step {}, cost {:.0f}", stage, iteration, cost)});
    return !control.cancelled();
  };
  Result<SceneMap> map = map_scene(*scene, recording, {.search = search_options(job)}, progress);
  if (control.cancelled())
    return fail(ErrorCode::Unwritable, "stopped before the map was finished: nothing was written",
                {.source = job.folder.string()});
  if (!map) return tl::unexpected(map.error());
  report.map = std::move(*map);
  report.corner_chi2_per_dof = corner_chi2_per_dof(report.map);
  report.file = video_map_file(job, *anchors, report.map);
  if (report.file.tags.tags.empty()) return tl::unexpected(no_tag_left(job, report.map));
  report.trajectory = camera_path(recording.frames, report.map);
  list_prior_differences(job.prior, *anchors, report);
  if (Status same = check_prior_place(job.prior, *anchors, report); !same)
    return tl::unexpected(same.error());
  list_distances(job, report);
  warn_of(*anchors, report);
  return report;
}

Result<MapVideoReport> map_video(const MapVideoJob& job, const TagFinder& finder, const JobControl& control) {
  const Stopwatch watch;
  if (Status sound = check(job); !sound) return tl::unexpected(sound.error());
  if (Status status = check_videos_differ(job.videos); !status) return tl::unexpected(status.error());
  if (Status status = check_output_folder(job.folder); !status) return tl::unexpected(status.error());
  std::vector<std::string> warnings;
  Result<std::vector<SceneFrame>> frames = detect_in_videos(job, finder, control, warnings);
  if (!frames) return tl::unexpected(frames.error());
  Result<MapVideoReport> report = map_views(job, std::move(*frames), control);
  if (!report) return report;
  report->warnings.insert(report->warnings.begin(), warnings.begin(), warnings.end());
  if (Status status = write_all(job, watch, *report); !status) return tl::unexpected(status.error());
  return report;
}

namespace {

/// A tag in the map and its number of observations.
struct VideoTag {
  TagId id{};
  MappedTag tag{};
  int observations = 0;
};

ReportFields fields(const VideoTag& tag) {
  return {{"tag", "Family and id", to_string(tag.id)},
          {"map_t_tag_m", "Position of the centre in the map: x, y, z", tag.tag.map_T_tag.translation()},
          {"sigma_m", "Standard deviations of the position along x, y, z", position_sigma_m(tag.tag)},
          {"observations", "Number of observations in use", tag.observations}};
}

std::vector<VideoTag> tags_of(const MapFile& file) {
  std::vector<VideoTag> tags;
  tags.reserve(file.tags.tags.size());
  for (const auto& [id, tag] : file.tags.tags) tags.push_back({id, tag, file.observations.at(id)});
  return tags;
}

ReportFields intrinsics_fields(const std::vector<FoundIntrinsics>& cameras) {
  ReportFields by_name;
  for (const FoundIntrinsics& lens : cameras) {
    for (Eigen::Index i = 0; i < lens.found.size(); ++i)
      by_name.push_back(
          {lens.names[static_cast<std::size_t>(i)], "Parameter of the camera",
           ReportFields{{"given", "Value in the calibration", lens.given[i]},
                        {"given_sigma", "Standard deviation of this value", lens.prior_sigma[i]},
                        {"found", "Estimated value", lens.found[i]},
                        {"sigma", "Standard deviation of the estimate", lens.sigma[i]}}});
  }
  return by_name;
}

}  // namespace

ReportFields fields(const TagBesidePrior& tag) {
  return {{"tag", "Family and id", to_string(tag.tag)},
          {"off_m", "Position relative to that in the older map: x, y, z", tag.off_m},
          {"sigma_m", "Standard deviations of the position in the new map along x, y, z", tag.sigma_m},
          {"turned_rad", "Angle from the orientation in the older map", tag.turned_rad}};
}

ReportFields fields(const MeasuredResidual& distance) {
  const MeasuredDistance& given = distance.given;
  return {{"tags", "Both tags", std::array{to_string(given.a), to_string(given.b)}},
          {"measured_m", "Measured distance", given.measured_m},
          {"sigma_m", "Standard deviation of the measurement", given.sigma_m},
          {"found_m", "Distance in the map", distance.found_m},
          {"off_sigma", "Distance in the map minus measured distance, in standard deviations",
           (distance.found_m - given.measured_m) / given.sigma_m}};
}

namespace {

std::vector<std::string> prior_only_tags(const SceneMap& map) {
  std::vector<std::string> tags;
  tags.reserve(map.prior_only.size());
  for (const auto& [tag, count] : map.prior_only) tags.push_back(to_string(tag));
  return tags;
}

}  // namespace

ReportFields fields(const MapVideoReport& report) {
  return {
      {"images", "Number of images in the videos", report.images},
      {"images_with_pose", "Number of images with a camera pose", report.trajectory.size()},
      {"anchor", "Anchor tag", to_string(report.file.anchor)},
      {"tags", "One entry per tag in the map", tags_of(report.file)},
      {"beside_prior", "With `prior`: one entry per tag in both maps that is not an exact anchor",
       report.beside},
      {"observations", "Number of tag observations", report.map.observations.seen.size()},
      {"rejected_observations", "Number of observations rejected as outliers", report.map.rejected.size()},
      {"unreliable_observations", "Further observations, with unreliable corners",
       report.map.observations.unreliable},
      {"prior_only_tags",
       "Tags that only their given pose places; no observation connects them to other tags",
       prior_only_tags(report.map)},
      {"thin_cuts", kThinCutsHelp, named_cuts(report.map.thin_cuts)},
      {"noise_px", "Standard deviation of a corner coordinate", report.map.noise_px},
      {"reprojection_mean_px", "Mean reprojection error of the corners in use",
       report.map.reprojection_mean_px},
      {"correlated_images", "Successive images that count as one, as corner errors are correlated",
       report.map.correlated_frames},
      {"corner_chi2_per_dof",
       "Chi-square of corners per degree of freedom; 1 if the detector's covariances are consistent",
       report.corner_chi2_per_dof},
      {"wrong_sizes", "Tags whose given size contradicts the observations; the map has the size found",
       report.map.wrong_sizes},
      {"moved_tags", kMovedTagsHelp, report.map.moved_tags},
      {"missing_tags", kMissingTagsHelp, report.map.missing_tags},
      {"duplicate_ids", kDuplicateIdsHelp, report.map.duplicate_tags},
      {"size_spread_percent", "Standard deviation of the other printed sizes, in percent of the given sizes",
       100 * report.map.size_spread},
      {"size_scale", "Factor from the given size to the estimated size of all tags; 1 if it is not estimated",
       report.map.size_scale},
      {"size_scale_sigma", "Standard deviation of this scale; 0 if it is not estimated",
       report.map.size_sigma},
      {"distances", "With `distance`: one entry per measured distance", report.measured},
      {"intrinsics", "By parameter of a camera with standard deviations: given, given_sigma, found, sigma",
       intrinsics_fields(report.map.intrinsics)},
      {"files", "Files that were written", report.files},
      {"wall_s", "Duration of the run", report.wall_s},
      {"warnings", "Warnings about the map, one sentence each", report.warnings}};
}

std::string to_text(const MapVideoReport& report, const std::string& folder) {
  std::string text =
      fmt::format("{}: {} from {} ({} with a pose)\n", folder, counted(report.file.tags.tags.size(), "tag"),
                  counted(report.images, "image"), report.trajectory.size());
  text += fmt::format(
      "reprojection error {:.2f} px (mean), noise {:.2f} px; {:.1f} successive images count as one\n",
      report.map.reprojection_mean_px, report.map.noise_px, report.map.correlated_frames);
  for (const FoundIntrinsics& lens : report.map.intrinsics)
    text += fmt::format("focal length {:.1f} +- {:.1f} px (given {:.1f} +- {:.1f})\n", lens.found[0],
                        lens.sigma[0], lens.given[0], lens.prior_sigma[0]);
  if (!report.measured.empty())
    text += fmt::format("estimated tag size: {:.4f} +- {:.4f} times the given one\n", report.map.size_scale,
                        report.map.size_sigma);
  for (const MeasuredResidual& d : report.measured)
    text += fmt::format("{} to {}: {:.4f} m in the map, measured {:.4f} m, {:+.1f} sigma\n",
                        to_string(d.given.a), to_string(d.given.b), d.found_m, d.given.measured_m,
                        (d.found_m - d.given.measured_m) / d.given.sigma_m);
  text += "  tag                   x m      y m      z m   sigma x  sigma y  sigma z m    images\n";
  for (const auto& [id, tag] : report.file.tags.tags) {
    const Eigen::Vector3d& p = tag.map_T_tag.translation();
    const Eigen::Vector3d s = position_sigma_m(tag);
    text += fmt::format("  {:<16}{:>9.4f}{:>9.4f}{:>9.4f}{:>10.4f}{:>9.4f}{:>9.4f}{:>12}{}\n", to_string(id),
                        p.x(), p.y(), p.z(), s.x(), s.y(), s.z(), report.file.observations.at(id),
                        id == report.file.anchor ? "   anchor" : "");
  }
  for (const TagBesidePrior& tag : report.beside)
    text += fmt::format(
        "{} is {:+.4f} {:+.4f} {:+.4f} m (x y z) from its pose in the prior map, rotated {:.1f} deg\n",
        to_string(tag.tag), tag.off_m.x(), tag.off_m.y(), tag.off_m.z(), to_degrees(tag.turned_rad));
  return text;
}

}  // namespace waymark

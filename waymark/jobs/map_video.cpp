#include "waymark/jobs/map_video.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "waymark/config/tagslam_write.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/trajectory_file.hpp"
#include "waymark/config/wpilib_layout.hpp"
#include "waymark/jobs/lap_input.hpp"
#include "waymark/jobs/route_files.hpp"
#include "waymark/jobs/staged_folder.hpp"
#include "waymark/jobs/stopwatch.hpp"
#include "waymark/mapping/scene/frame_correlation.hpp"
#include "waymark/mapping/scene/scene_checks.hpp"

#include <nlohmann/json.hpp>

namespace waymark {
namespace {

constexpr std::size_t kWalls = 0;  ///< the body that the tags are on
constexpr std::size_t kHand = 1;   ///< the body that carries the camera

/// The tags of all videos, one after the other in time.
struct Filmed {
  std::vector<SceneFrame> frames{};
  std::map<TagId, int> count{};
  std::size_t pictures = 0;
};

Result<Filmed> film(const MapVideoJob& job, const TagFinder& finder, const JobControl& control,
                    std::vector<std::string>& warnings) {
  Filmed filmed;
  Duration offset{};
  for (const std::string& video : job.videos) {
    const auto add = [&](const VideoFrame& picture, TagFrame& tags) -> Status {
      for (const TagDetection& detection : tags.detections) ++filmed.count[detection.tag];
      filmed.frames.push_back({picture.stamp + offset, {{0, std::move(tags.detections)}}});
      return {};
    };
    const Result<VideoTags> found = find_video_tags(video, finder, &job.camera, control, add);
    if (!found) return tl::unexpected(found.error());
    filmed.pictures += found->pictures;
    for (const VideoProblem& problem : found->problems) warnings.push_back(to_string(problem.error));
    offset = filmed.frames.back().stamp.time_since_epoch() + std::chrono::seconds(1);
  }
  if (filmed.count.empty())
    return fail(ErrorCode::NotFound, "no tag was found in any picture", {.source = job.videos.front()},
                "Give the family of the tags with --family; `waymark detect` shows what is found.");
  return filmed;
}

/// Where the map stands.
struct VideoAnchor {
  TagId tag{};
  SE3 map_T_tag{};
  bool assumed = false;  ///< upright, at the origin
};

Result<VideoAnchor> anchor_of(const MapVideoJob& job, const std::map<TagId, int>& count) {
  VideoAnchor anchor;
  if (job.anchor) {
    anchor.tag = *job.anchor;
    if (!count.contains(anchor.tag))
      return fail(ErrorCode::NotFound, to_string(anchor.tag) + " was not seen", {.key = "--anchor"},
                  "`waymark detect` lists the tags of a video.");
  } else {
    int most = 0;
    for (const bool known : {true, false}) {
      for (const auto& [tag, seen] : count) {
        if (seen <= most || (known && job.prior.find(tag) == nullptr)) continue;
        most = seen;
        anchor.tag = tag;
      }
      if (most > 0) break;
    }
  }
  const MappedTag* prior = job.prior.find(anchor.tag);
  anchor.assumed = !job.map_T_anchor && prior == nullptr;
  anchor.map_T_tag = job.map_T_anchor   ? *job.map_T_anchor
                     : prior != nullptr ? prior->map_T_tag
                                        : anchor_at_origin();
  return anchor;
}

ScenePrior exactly(const SE3& pose) {
  constexpr double kSmall = 1e-6;  // [m, rad]
  return ScenePrior::of(pose, Eigen::Vector3d::Constant(kSmall), Eigen::Vector3d::Constant(kSmall));
}

/// The camera is where the hand is; what it looks at stands still.
Result<TagScene> scene_of(const MapVideoJob& job, const Filmed& filmed, const VideoAnchor& anchor) {
  TagScene scene;
  scene.bodies.push_back({.name = "map", .map_T_body = exactly(SE3())});
  scene.bodies.push_back({.name = "hand", .is_static = false});
  scene.cameras.push_back(
      {.name = "camera", .model = job.camera, .body = kHand, .body_T_cam = exactly(SE3())});
  for (const auto& [tag, seen] : filmed.count) {
    const Result<double> size_m = job.sizes.size_m(tag);
    if (!size_m) return tl::unexpected(size_m.error());
    if (tag == anchor.tag)
      scene.bodies[kWalls].tags.push_back(
          {.id = tag, .size_m = *size_m, .body_T_tag = exactly(anchor.map_T_tag)});
    else if (*size_m != job.sizes.default_size_m)
      scene.bodies[kWalls].tags.push_back({.id = tag, .size_m = *size_m});
  }
  scene.bodies[kWalls].default_tag_size_m = job.sizes.default_size_m.value_or(0);
  scene.default_body = kWalls;
  return scene;
}

/// The tags that came out, with covariances of as many independent pictures as there are.
MapFile video_map_file(const MapVideoJob& job, const VideoAnchor& anchor, const MapVideoReport& report) {
  MapFile file{.anchor = anchor.tag,
               .provenance = {{"method", "bundle"},
                              {"recording", std::filesystem::path(job.videos.front()).filename().string()}}};
  const SceneMap& map = report.map;
  const SceneBody& walls = map.scene.bodies[kWalls];
  for (std::size_t t = 0; t < walls.tags.size(); ++t) {
    const auto pose = map.map_T_tag(kWalls, t);
    const PoseIndex index = map.problem.tags[kWalls][t];
    const auto observations = std::ranges::count_if(
        map.problem.bundle.corners, [&](const CornerTerm& term) { return term.used && term.tag == index; });
    if (!pose || observations == 0) continue;
    const bool is_anchor = walls.tags[t].id == anchor.tag;
    const Matrix6 covariance = is_anchor ? Matrix6(Matrix6::Zero())
                                         : Matrix6(report.correlated_frames * map.covariance.poses[index]);
    file.tags.tags[walls.tags[t].id] = {.map_T_tag = is_anchor ? anchor.map_T_tag : *pose,
                                        .size_m = walls.tags[t].size_m,
                                        .covariance = covariance};
    file.observations[walls.tags[t].id] = static_cast<int>(observations);
  }
  return file;
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

void hold_beside(const TagMap& prior, MapVideoReport& report) {
  for (const auto& [id, tag] : report.file.tags.tags) {
    const MappedTag* known = prior.find(id);
    if (known == nullptr || id == report.file.anchor) continue;
    const SO3 turn = known->map_T_tag.rotation().inverse() * tag.map_T_tag.rotation();
    report.beside.push_back({.tag = id,
                             .off_m = tag.map_T_tag.translation() - known->map_T_tag.translation(),
                             .sigma_m = position_sigma_m(tag),
                             .turned_rad = turn.log().norm()});
  }
}

void warn_of(const VideoAnchor& anchor, MapVideoReport& report) {
  const SceneMap& map = report.map;
  if (anchor.assumed)
    report.warnings.push_back(fmt::format(
        "{} is taken to hang upright at the origin of the map; --anchor and --anchor-pose place a tag",
        to_string(anchor.tag)));
  for (const std::vector<TagId>& group : map.unconnected) {
    std::string names;
    for (const TagId& tag : group) names += (names.empty() ? "" : ", ") + std::to_string(tag.number);
    report.warnings.push_back("never in one picture with a tag that leads to the map, left out: " + names);
  }
  for (std::string& words : scene_doubts(map)) report.warnings.push_back(std::move(words));
  if (!map.rejected.empty())
    report.warnings.push_back(fmt::format("{} of {} observations contradict the others and were left out",
                                          map.rejected.size(), map.observations.seen.size()));
}

Status write_all(const MapVideoJob& job, const Stopwatch& watch, MapVideoReport& report) {
  Result<StagedFolder> staged = StagedFolder::open(job.folder);
  if (!staged) return tl::unexpected(staged.error());
  const auto named = [&](const char* name) { report.files.push_back((job.folder / name).string()); };
  for (const char* name : {"map.yaml", "layout.json", "poses.yaml", "trajectory.txt", "summary.json"})
    named(name);
  Status status = write_map(staged->path() / "map.yaml", report.file);
  const auto write = [&](const char* name, const std::string& text) {
    if (status) status = write_text_file(staged->path() / name, text);
  };
  write("layout.json", to_wpilib_layout(report.file.tags));
  write("poses.yaml", to_tagslam_poses(report.map));
  write("trajectory.txt", to_tum(report.trajectory));
  report.wall_s = watch.seconds();
  write("summary.json", to_json(report).dump(2) + "\n");
  if (!status) return staged->failed(status.error());
  std::vector<std::string> routes = route_names(job.folder);  // of a map of another kind
  routes.emplace_back();
  const auto aside = staged->put_in_place(files_of_map(routes));
  return aside ? Status() : tl::unexpected(aside.error());
}

}  // namespace

Eigen::Vector3d position_sigma_m(const MappedTag& tag) {
  if (!tag.covariance) return Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -SO3::hat(tag.map_T_tag.translation());
  return (J * *tag.covariance * J.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
}

Result<MapVideoReport> map_video(const MapVideoJob& job, const TagFinder& finder, const JobControl& control) {
  const Stopwatch watch;
  if (Status status = check_output_folder(job.folder); !status) return tl::unexpected(status.error());
  MapVideoReport report;
  Result<Filmed> filmed = film(job, finder, control, report.warnings);
  if (!filmed) return tl::unexpected(filmed.error());
  const Result<VideoAnchor> anchor = anchor_of(job, filmed->count);
  if (!anchor) return tl::unexpected(anchor.error());
  const Result<TagScene> scene = scene_of(job, *filmed, *anchor);
  if (!scene) return tl::unexpected(scene.error());
  const SceneRecording recording{.frames = std::move(filmed->frames)};
  const MapProgress progress = [&](const std::string& stage, int iteration, double cost) {
    control.progress({fmt::format("{}: step {}, cost {:.0f}", stage, iteration, cost)});
    return !control.cancelled();
  };
  Result<SceneMap> map = map_scene(*scene, recording, {.search = job.search}, progress);
  if (control.cancelled())
    return fail(ErrorCode::Unwritable, "stopped before the map was finished: nothing was written",
                {.source = job.folder.string()});
  if (!map) return tl::unexpected(map.error());
  report.map = std::move(*map);
  report.pictures = filmed->pictures;
  report.correlated_frames = correlated_frames(report.map);
  report.file = video_map_file(job, *anchor, report);
  report.trajectory = camera_path(recording.frames, report.map);
  hold_beside(job.prior, report);
  warn_of(*anchor, report);
  if (Status status = write_all(job, watch, report); !status) return tl::unexpected(status.error());
  return report;
}

nlohmann::ordered_json to_json(const MapVideoReport& report) {
  const auto list = [](const Eigen::Vector3d& v) {
    return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
  };
  nlohmann::ordered_json tags = nlohmann::ordered_json::array();
  for (const auto& [id, tag] : report.file.tags.tags)
    tags.push_back({{"tag", to_string(id)},
                    {"map_t_tag_m", list(tag.map_T_tag.translation())},
                    {"sigma_m", list(position_sigma_m(tag))},
                    {"observations", report.file.observations.at(id)}});
  nlohmann::ordered_json beside = nlohmann::ordered_json::array();
  for (const TagBesidePrior& tag : report.beside)
    beside.push_back({{"tag", to_string(tag.tag)},
                      {"off_m", list(tag.off_m)},
                      {"sigma_m", list(tag.sigma_m)},
                      {"turned_rad", tag.turned_rad}});
  return {{"pictures", report.pictures},
          {"pictures_with_pose", report.trajectory.size()},
          {"anchor", to_string(report.file.anchor)},
          {"tags", std::move(tags)},
          {"beside_prior", std::move(beside)},
          {"observations", report.map.observations.seen.size()},
          {"rejected_observations", report.map.rejected.size()},
          {"noise_px", report.map.noise_px},
          {"reprojection_mean_px", report.map.reprojection_mean_px},
          {"correlated_pictures", report.correlated_frames},
          {"files", report.files},
          {"wall_s", report.wall_s},
          {"warnings", report.warnings}};
}

}  // namespace waymark

#include "waymark/app/map/map_words.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/map/map_extension.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/yaml/world_file.hpp"

namespace waymark {
namespace {

Result<SE3> anchor_pose_of(const std::vector<double>& p) {
  if (p.size() != 6)
    return fail(ErrorCode::InvalidArgument, fmt::format("{} numbers instead of six", p.size()),
                {.key = "--anchor-pose"}, "X Y Z in metres, then roll, pitch and yaw in degrees.");
  if (!std::ranges::all_of(p, [](double x) { return std::isfinite(x); }))
    return fail(ErrorCode::InvalidArgument, "a number that is not finite", {.key = "--anchor-pose"});
  constexpr double kFarthest_m = 1e4;
  if (std::ranges::any_of(p.begin(), p.begin() + 3, [](double x) { return std::abs(x) > kFarthest_m; }))
    return fail(ErrorCode::InvalidArgument, "the anchor stands more than 10 km from where the map begins",
                {.key = "--anchor-pose"}, "X Y Z in metres, then roll, pitch and yaw in degrees.");
  return SE3(SO3::from_rpy(to_radians(p[3]), to_radians(p[4]), to_radians(p[5])),
             Eigen::Vector3d(p[0], p[1], p[2]));
}

}  // namespace

Result<SetupOverrides> overrides_of(const AnchorWords& words) {
  SetupOverrides overrides;
  if (!words.anchor.empty()) overrides.anchor = words.anchor;
  if (!words.anchor_pose.empty()) {
    const Result<SE3> pose = anchor_pose_of(words.anchor_pose);
    if (!pose) return tl::unexpected(pose.error());
    overrides.map_T_anchor = *pose;
  }
  if (words.tag_size_m && !(*words.tag_size_m > 0 && *words.tag_size_m < 100))
    return fail(ErrorCode::InvalidArgument, fmt::format("{} is not a size in metres", *words.tag_size_m),
                {.key = "--tag-size-m"},
                "Measure the side of the black square, for example --tag-size-m 0.16.");
  overrides.tag_size_m = words.tag_size_m;
  return overrides;
}

Status describe_map(const MapDescription& of, MapJob& job) {
  const Result<MapMethod> method = parse_map_method(of.method);
  if (!method) return tl::unexpected(method.error());
  job.options.method = *method;
  if (!of.extend.empty() && (!of.anchor.empty() || !of.anchor_pose.empty()))
    return fail(ErrorCode::InvalidArgument, "the map that is extended says where its tags stand",
                {.key = of.anchor.empty() ? "--anchor-pose" : "--anchor"}, "Leave it out.");
  const auto sizes = parse_tag_sizes(of.tag_sizes);
  if (!sizes) return tl::unexpected(sizes.error());
  const auto overrides =
      overrides_of({.anchor = of.anchor, .anchor_pose = of.anchor_pose, .tag_size_m = sizes->default_size_m});
  if (!overrides) return tl::unexpected(overrides.error());
  job.overrides = *overrides;
  job.overrides.size_by_tag_m = sizes->size_by_tag_m;
  if (of.world.empty()) return {};
  const auto path = find_shared("worlds", of.world);
  if (!path) return tl::unexpected(path.error());
  Result<World> truth = read_world(*path);
  if (!truth) return tl::unexpected(truth.error());
  job.truth = std::move(*truth);
  return {};
}

Status read_described_maps(const MapDescription& of, MapJob& job) {
  if (!of.prior.empty()) {
    Result<LandmarksFile> older = read_landmarks(of.prior, job.overrides.tag_size_m);
    if (!older) return tl::unexpected(older.error());
    job.prior = std::move(*older);
  }
  return read_extension(of.extend, of.route_name, of.freeze, of.remove, job);
}

Result<MapSceneJob> described_scene(const MapWords& words, const SearchOptions& search) {
  MapSceneJob job = words.scene;
  job.recording = words.job.lap;
  job.folder = words.job.folder;
  if (Status status = describe_scene(words.model, words.free_intrinsics, job); !status)
    return tl::unexpected(status.error());
  job.options.search = search;
  return job;
}

Status check_effects(const MapWords& words, const GivenFlags& given) {
  if (words.job.lap.empty())
    return fail(ErrorCode::InvalidArgument, "LAP is required: a recording, or the verb 'convert'");
  if (words.job.folder.empty()) return fail(ErrorCode::InvalidArgument, "--output is required");
  if (!words.scene.tagslam.empty()) return {};
  const char* of_scenes = "this is about scenes that TagSLAM's files describe";
  const char* tagslam = "Give their folder with --tagslam, or leave it out.";
  FlagRefusals refused(given);
  refused.flags(words.model != "waymark", {"--model"}, of_scenes, tagslam);
  refused.flags(true, {"--against", "--free-intrinsics"}, of_scenes, tagslam);
  refused.flags(words.of.extend.empty(), {"--map-sigma"}, "this is about the map that a lap extends",
                "Give it with --extend.");
  return refused.status();
}

}  // namespace waymark

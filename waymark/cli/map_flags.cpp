#include "waymark/cli/map_flags.hpp"

#include <algorithm>

#include "waymark/cli/frame_flags.hpp"

namespace waymark::cli {
namespace {

constexpr const char* kNotOfScenes = "this has no effect on scenes that TagSLAM's files describe";
constexpr const char* kOfScenes = "this is about scenes that TagSLAM's files describe";
constexpr const char* kTagslam = "Give their folder with --tagslam, or leave it out.";
constexpr const char* kNoTagslam = "Leave it out, or leave out --tagslam.";

/// Options that scenes have no use for.
Status check_tagslam_flags(const MapArgs& args) {
  const std::vector<std::string> known = {
      "LAP",    "output", "tagslam",  "model",        "against",     "json",           "help",
      "config", "set",    "help-all", "outlier-chi2", "robust-chi2", "max-iterations", "free-intrinsics"};
  for (const CLI::Option* option : args.settings.app().get_options()) {
    const std::string name = option->get_single_name();
    if (option->count() > 0 && std::ranges::find(known, name) == known.end())
      return fail(ErrorCode::InvalidArgument, kNotOfScenes, {.key = option->get_name()}, kNoTagslam);
  }
  Refusals refused(args.settings.app());
  args.refuse_lap_options(refused, kNotOfScenes, kNoTagslam);
  refused.all(true, args.detector, kNotOfScenes, kNoTagslam);
  return refused.status();
}

}  // namespace

void MapArgs::refuse_lap_options(Refusals& refused, const char* why, const char* hint) const {
  for (const char* key : {"estimate_noise", "find_mounting", "keep_mounting"})
    refused.options(true, bundle, why, hint, key);
  for (const std::string& key : field_names<LapModelOptions>()) refused.options(true, bundle, why, hint, key);
  refused.options(true, chain, why, hint);
  refused.options(true, points, why, hint);
  refused.options(true, route, why, hint);
}

Status MapArgs::check() const {
  if (job.lap.empty())
    return fail(ErrorCode::InvalidArgument, "LAP is required: a recording, or the verb 'convert'");
  if (job.folder.empty()) return fail(ErrorCode::InvalidArgument, "--output is required");
  if (!scene.tagslam.empty()) return check_tagslam_flags(*this);
  const char* no_optimisation = "the method chain does not optimise";
  Refusals refused(settings.app());
  refused.flags(model != "waymark", {"--model"}, kOfScenes, kTagslam);
  refused.flags(true, {"--against", "--free-intrinsics"}, kOfScenes, kTagslam);
  refused.options(of.method == "chain", bundle, no_optimisation, "Leave it out, or --method chain.");
  refused.flags(of.extend.empty(), {"--map-sigma"}, "this is about the map that a lap extends",
                "Give it with --extend.");
  return refused.status();
}

Result<MapJob> MapArgs::make_job() const {
  MapJob made = job;
  Status status = bundle.apply(made.options.bundle);
  if (status) status = chain.apply(made.options.chain);
  if (status) status = points.apply(made.points);
  if (status) status = route.apply(made.options.route);
  if (status) status = describe_map(of, made);
  if (!status) return tl::unexpected(status.error());
  return made;
}

Result<MapSceneJob> MapArgs::make_scene_job() const {
  MapSceneJob made = scene;
  made.recording = job.lap;
  made.folder = job.folder;
  BundleMapOptions options;
  Status status = bundle.apply(options);
  if (status) status = describe_scene(model, free_intrinsics, made);
  if (!status) return tl::unexpected(status.error());
  made.options.search = options.search;
  return made;
}

MapArgs::MapArgs(CLI::App& verb)
    : settings(verb),
      bundle(settings, "bundle", "Method bundle"),
      chain(settings, "chain", "Where the search starts, and method chain"),
      points(settings, "points", "Recordings with poses of tags and no corners"),
      route(settings, "route", "Route"),
      detector(settings, "Detector") {
  add_option(verb, "LAP", job.lap,
             "Recording of a taught lap, with --tagslam of tags and odometry; or a video");
  add_option(verb, "MORE", job.more,
             "Further files of the same lap: tables of odometry or of an IMU, parts of a bag");
  add_option(verb, "--robot FILE", job.robot,
             "Camera and its mounting: a robot's file, or a name. Unless given: the recording's");
  add_frame_flags(verb, job.frames);
  add_option(verb, "-o,--output FOLDER", job.folder, "Folder for the map, the route and the figures");
  add_option(verb, "--method NAME", of.method,
             "Mapping method: bundle (bundle adjustment of all observations and odometry) or chain (tag to "
             "tag, without optimisation)",
             kShown);
  add_option(verb, "--anchor TAG", of.anchor,
             "Anchor tag, which sets the origin of the map, for example tag36h11:0; of a video with --prior "
             "several (3,7,9). Unless given: that of the recording");
  add_option(verb, "--anchor-pose X Y Z ROLL PITCH YAW", of.anchor_pose,
             "Where the anchor stands in the map: x y z [m] and roll pitch yaw [deg] of the tag's frame (x "
             "right, y down, z into the tag). Unless given: that of the recording; for another anchor the "
             "map's origin is its centre, map z is up, map x goes into the tag")
      ->expected(6);
  verb.add_option("--tag-size-m", of.tag_sizes,
                  "Side of the black square of the tags [m]; ID=SIZE for a tag of another size (repeatable). "
                  "Unless given: those of the recording")
      ->allow_extra_args(false)  // or it would take the recordings that follow for sizes
      ->type_name("SIZE");
  add_option(verb, "--world NAME", of.world,
             "Ground truth of the tags, where the recording does not hold it");
  add_option(verb, "--prior FILE", of.prior,
             "Older map of the place (map.yaml, or any that `waymark localize --map` takes) with which the "
             "new one is compared: tags swapped, moved or resized since are listed");
  add_option(verb, "--extend MAP", of.extend,
             "A map (map.yaml, or its folder) that this lap is to improve: the lap is moved onto it, and "
             "both are adjusted together; what the lap did not see stays. The older one is kept");
  add_option(verb, "--route-name NAME", of.route_name,
             "With --extend: the lap becomes the route of this name (route-NAME.yaml) beside those of the "
             "map, which stay");
  add_option(verb, "--freeze TAGS", of.freeze,
             "With --extend: tags that stay exactly where the map has them, such as 3,7 or tag36h11:3",
             kByCommas, kMore);
  add_option(verb, "--remove TAGS", of.remove,
             "Tags that were removed, with --extend: deleted from the map and from the lap", kByCommas,
             kMore);
  add_option(verb, "--map-sigma NUMBER", job.map_sigma_m,
             "Standard deviation of the tags' positions, with --extend, of a map without covariances, such "
             "as one measured by hand [m]",
             kShown, between(1e-6, 10.0), kMore);
  add_option(verb, "--tagslam FOLDER", scene.tagslam,
             "A folder with TagSLAM's tagslam.yaml, cameras.yaml and camera_poses.yaml (or a config.json): "
             "cameras and bodies are as they say, no floor is needed");
  add_option(verb, "--model NAME", model,
             "Cost model with --tagslam: waymark, or tagslam (TagSLAM's noise of every observation and of "
             "the cameras' poses)",
             kShown, kMore);
  add_flag(verb, "--free-intrinsics", free_intrinsics,
           "With --tagslam, cameras are adjusted too: focal lengths and principal point within 1 % (standard "
           "deviation) of what is given, distortion k within 0.05 and p within 0.005",
           kMore);
  add_option(verb, "--against FOLDER", scene.against,
             "With --tagslam, another solution (ref_static.csv, ref_trajectory.csv): both are about its "
             "frames and tags, and its cost is printed",
             kMore);
  verb.add_flag("--json", json, "One JSON object instead of words");
}

}  // namespace waymark::cli

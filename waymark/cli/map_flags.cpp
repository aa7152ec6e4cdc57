#include "waymark/cli/map_flags.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/base/suggest.hpp"
#include "waymark/cli/flags.hpp"
#include "waymark/cli/frame_flags.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/world_file.hpp"
#include "waymark/jobs/anchor_words.hpp"
#include "waymark/jobs/map_steps.hpp"
#include "waymark/jobs/poses.hpp"

namespace waymark::cli {
namespace {

constexpr const char* kNotOfScenes = "this has no effect on scenes that TagSLAM's files describe";
constexpr const char* kNoTagslam = "Leave it out, or leave out --tagslam.";

/// Options that scenes have no use for.
Status check_tagslam_flags(const MapArgs& args) {
  const std::vector<std::string> known = {
      "LAP",    "output", "tagslam",  "model",        "against",     "json",           "help",
      "config", "set",    "help-all", "outlier-chi2", "robust-chi2", "max-iterations", "free-intrinsics"};
  for (const CLI::Option* option : args.app.get_options()) {
    const std::string name = option->get_single_name();
    if (option->count() > 0 && std::ranges::find(known, name) == known.end())
      return fail(ErrorCode::InvalidArgument, kNotOfScenes, {.key = option->get_name()}, kNoTagslam);
  }
  const Status status = args.refuse_lap_options(kNotOfScenes, kNoTagslam);
  return status ? args.detector.refuse_all(kNotOfScenes, kNoTagslam) : status;
}

}  // namespace

Status MapArgs::refuse_lap_options(const char* why, const char* hint) const {
  for (const char* key : {"estimate_noise", "find_mounting", "keep_mounting"}) {
    if (Status status = refuse(bundle, why, hint, key); !status) return status;
  }
  Status status;
  LapModelOptions of_a_lap;
  LapModelOptions::fields(of_a_lap, [&](auto&, const Field& field) {
    if (status) status = refuse(bundle, why, hint, field.name);
  });
  if (status) status = refuse(chain, why, hint);
  if (status) status = refuse(points, why, hint);
  if (status) status = refuse(route, why, hint);
  return status;
}

Status MapArgs::check() const {
  const auto only_with_tagslam = [](const char* flag) {
    return fail(ErrorCode::InvalidArgument, "this is about scenes that TagSLAM's files describe",
                {.key = flag}, "Give their folder with --tagslam, or leave it out.");
  };
  if (lap.empty())
    return fail(ErrorCode::InvalidArgument, "LAP is required: a recording, or the verb 'convert'");
  if (folder.empty()) return fail(ErrorCode::InvalidArgument, "--output is required");
  if (!tagslam.empty()) return check_tagslam_flags(*this);
  if (model != "waymark") return only_with_tagslam("--model");
  if (!against.empty()) return only_with_tagslam("--against");
  if (free_intrinsics) return only_with_tagslam("--free-intrinsics");
  if (method == "chain") {
    if (Status status =
            refuse(bundle, "the method chain does not optimise", "Leave it out, or --method chain.");
        !status)
      return status;
  }
  if (!extend.empty()) return {};
  return refuse_flag(app, "--map-sigma", "this is about the map that a lap extends",
                     "Give it with --extend.");
}

Result<MapJob> MapArgs::make_job() const {
  MapJob made{.lap = lap, .folder = folder, .options = {}};
  made.more = more;
  made.robot = robot;
  made.frames = frames;
  made.map_sigma_m = map_sigma_m;
  if (Status status = bundle.apply(made.options.bundle); !status) return tl::unexpected(status.error());
  if (Status status = chain.apply(made.options.chain); !status) return tl::unexpected(status.error());
  if (Status status = points.apply(made.points); !status) return tl::unexpected(status.error());
  if (Status status = route.apply(made.options.route); !status) return tl::unexpected(status.error());
  const Result<MapMethod> known_method = parse_map_method(method);
  if (!known_method) return tl::unexpected(known_method.error());
  made.options.method = *known_method;
  if (!extend.empty() && (!anchor.empty() || !anchor_pose.empty()))
    return fail(ErrorCode::InvalidArgument, "the map that is extended says where its tags stand",
                {.key = anchor.empty() ? "--anchor-pose" : "--anchor"}, "Leave it out.");
  const auto sizes = parse_tag_sizes(tag_sizes);
  if (!sizes) return tl::unexpected(sizes.error());
  const auto overrides =
      overrides_of({.anchor = anchor, .anchor_pose = anchor_pose, .tag_size_m = sizes->default_size_m});
  if (!overrides) return tl::unexpected(overrides.error());
  made.overrides = *overrides;
  made.overrides.size_by_tag_m = sizes->size_by_tag_m;
  if (world.empty()) return made;
  const auto path = find_shared("worlds", world);
  if (!path) return tl::unexpected(path.error());
  Result<World> truth = read_world(*path);
  if (!truth) return tl::unexpected(truth.error());
  made.truth = std::move(*truth);
  return made;
}

Status MapArgs::read_maps(MapJob& job) const {
  if (!prior.empty()) {
    Result<LandmarksFile> older = read_landmarks(prior, job.overrides.tag_size_m);
    if (!older) return tl::unexpected(older.error());
    job.prior = std::move(*older);
  }
  return read_extension(extend, route_name, freeze, remove, job);
}

Result<MapSceneJob> MapArgs::make_scene_job() const {
  BundleMapOptions options;
  if (Status status = bundle.apply(options); !status) return tl::unexpected(status.error());
  const std::vector<std::string> models = {"waymark", "tagslam"};
  if (std::ranges::find(models, model) == models.end())
    return fail(ErrorCode::InvalidArgument, fmt::format("there is no model '{}'", model), {.key = "--model"},
                suggestion(model, models));
  if (free_intrinsics && model == "tagslam")
    return fail(ErrorCode::InvalidArgument, "TagSLAM's model takes the cameras as given",
                {.key = "--free-intrinsics"}, "Leave it out, or leave out --model tagslam.");
  return MapSceneJob{.recording = lap,
                     .tagslam = tagslam,
                     .folder = folder,
                     .against = against,
                     .options = {.model = model == "tagslam" ? SceneModel::Tagslam : SceneModel::Waymark,
                                 .search = options.search,
                                 .free_intrinsics = free_intrinsics}};
}

void MapArgs::add_to(CLI::App& verb) {
  add_option(verb, "LAP", lap, "Recording of a taught lap, with --tagslam of tags and odometry; or a video");
  add_option(verb, "MORE", more,
             "Further files of the same lap: tables of odometry or of an IMU, parts of a bag");
  add_option(verb, "--robot FILE", robot,
             "Camera and its mounting: a robot's file, or a name. Unless given: the recording's");
  add_frame_flags(verb, frames);
  add_option(verb, "-o,--output FOLDER", folder, "Folder for the map, the route and the figures");
  add_option(verb, "--method NAME", method,
             "Mapping method: bundle (bundle adjustment of all observations and odometry) or chain (tag to "
             "tag, without optimisation)",
             kShown);
  add_option(verb, "--anchor TAG", anchor,
             "Anchor tag, which sets the origin of the map, for example tag36h11:0; of a video with --prior "
             "several (3,7,9). Unless given: that of the recording");
  add_option(verb, "--anchor-pose X Y Z ROLL PITCH YAW", anchor_pose,
             "Where the anchor stands in the map: x y z [m] and roll pitch yaw [deg] of the tag's frame (x "
             "right, y down, z into the tag). Unless given: that of the recording; for another anchor the "
             "map's origin is its centre, map z is up, map x goes into the tag")
      ->expected(6);
  verb.add_option("--tag-size-m", tag_sizes,
                  "Side of the black square of the tags [m]; ID=SIZE for a tag of another size (repeatable). "
                  "Unless given: those of the recording")
      ->allow_extra_args(false)  // or it would take the recordings that follow for sizes
      ->type_name("SIZE");
  add_option(verb, "--world NAME", world, "Ground truth of the tags, where the recording does not hold it");
  add_option(verb, "--prior FILE", prior,
             "Older map of the place (map.yaml, or any that `waymark localize --map` takes) with which the "
             "new one is compared: tags swapped, moved or resized since are listed");
  add_option(verb, "--extend MAP", extend,
             "A map (map.yaml, or its folder) that this lap is to improve: the lap is moved onto it, and "
             "both are adjusted together; what the lap did not see stays. The older one is kept");
  add_option(verb, "--route-name NAME", route_name,
             "With --extend: the lap becomes the route of this name (route-NAME.yaml) beside those of the "
             "map, which stay");
  add_option(verb, "--freeze TAGS", freeze,
             "With --extend: tags that stay exactly where the map has them, such as 3,7 or tag36h11:3",
             kByCommas, kMore);
  add_option(verb, "--remove TAGS", remove,
             "Tags that were removed, with --extend: deleted from the map and from the lap", kByCommas,
             kMore);
  add_option(verb, "--map-sigma NUMBER", map_sigma_m,
             "Standard deviation of the tags' positions, with --extend, of a map without covariances, such "
             "as one measured by hand [m]",
             kShown, between(1e-6, 10.0), kMore);
  add_option(verb, "--tagslam FOLDER", tagslam,
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
  add_option(verb, "--against FOLDER", against,
             "With --tagslam, another solution (ref_static.csv, ref_trajectory.csv): both are about its "
             "frames and tags, and its cost is printed",
             kMore);
  verb.add_flag("--json", json, "One JSON object instead of words");
}

}  // namespace waymark::cli

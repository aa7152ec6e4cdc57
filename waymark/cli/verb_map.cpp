#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/base/angles.hpp"
#include "waymark/base/suggest.hpp"
#include "waymark/cli/console_control.hpp"
#include "waymark/cli/detections_json.hpp"
#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/frame_flags.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/map_text.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/page_files.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/world_file.hpp"
#include "waymark/jobs/map_steps.hpp"

namespace waymark::cli {
namespace {

struct MapArgs {
  explicit MapArgs(CLI::App& verb)
      : app(verb),
        bundle(verb, "Method bundle"),
        chain(verb, "Where the search starts, and method chain"),
        points(verb, "Recordings with poses of tags and no corners"),
        route(verb, "Route"),
        detector(verb) {}

  const CLI::App& app;
  std::string lap;
  std::vector<std::string> more;
  std::string robot;
  CameraChoice frames;
  std::string folder;
  std::string method = "bundle";
  std::string anchor;
  std::optional<double> tag_size_m;
  std::string world;
  std::string prior;
  std::string extend;
  std::string route_name;
  std::vector<std::string> freeze;
  std::vector<std::string> remove;
  double map_sigma_m = kMapSigma_m;
  std::string tagslam;
  std::string model = "waymark";
  std::string against;
  bool json = false;
  std::vector<double> anchor_pose;
  OptionFlags<BundleMapOptions> bundle;
  OptionFlags<ChainOptions> chain;
  OptionFlags<LandmarkMapOptions> points;
  OptionFlags<RouteOptions> route;
  DetectorFlags detector;
};

Result<MapJob> job_of(const MapArgs& args) {
  MapJob job{.lap = args.lap, .folder = args.folder, .options = {.method = args.method}};
  job.more = args.more;
  job.robot = args.robot;
  job.frames = args.frames;
  job.map_sigma_m = args.map_sigma_m;
  if (Status status = args.bundle.apply(job.options.bundle); !status) return tl::unexpected(status.error());
  if (Status status = args.chain.apply(job.options.chain); !status) return tl::unexpected(status.error());
  if (Status status = args.points.apply(job.points); !status) return tl::unexpected(status.error());
  if (Status status = args.route.apply(job.options.route); !status) return tl::unexpected(status.error());
  const std::vector<std::string> methods = map_methods();
  if (std::ranges::find(methods, args.method) == methods.end())
    return fail(ErrorCode::InvalidArgument, fmt::format("there is no method '{}'", args.method),
                {.key = "--method"}, suggestion(args.method, methods));
  if (!args.extend.empty() && (!args.anchor.empty() || !args.anchor_pose.empty()))
    return fail(ErrorCode::InvalidArgument, "the map that is extended says where its tags stand",
                {.key = args.anchor.empty() ? "--anchor-pose" : "--anchor"}, "Leave it out.");
  if (!args.anchor.empty()) job.overrides.anchor = args.anchor;
  if (!args.anchor_pose.empty()) {
    const std::vector<double>& p = args.anchor_pose;
    if (!std::ranges::all_of(p, [](double x) { return std::isfinite(x); }))
      return fail(ErrorCode::InvalidArgument, "a number that is not finite", {.key = "--anchor-pose"});
    constexpr double kFarthestMetres = 1e4;
    if (std::ranges::any_of(p.begin(), p.begin() + 3, [](double x) { return std::abs(x) > kFarthestMetres; }))
      return fail(ErrorCode::InvalidArgument, "the anchor stands more than 10 km from where the map begins",
                  {.key = "--anchor-pose"}, "X Y Z in metres, then roll, pitch and yaw in degrees.");
    job.overrides.map_T_anchor = SE3(SO3::from_rpy(to_radians(p[3]), to_radians(p[4]), to_radians(p[5])),
                                     Eigen::Vector3d(p[0], p[1], p[2]));
  }
  if (args.tag_size_m && !(*args.tag_size_m > 0 && *args.tag_size_m < 100))
    return fail(ErrorCode::InvalidArgument, fmt::format("{} is not a size in metres", *args.tag_size_m),
                {.key = "--tag-size-m"},
                "Measure the side of the black square, for example --tag-size-m 0.16.");
  job.overrides.tag_size_m = args.tag_size_m;
  if (args.world.empty()) return job;
  const auto path = find_shared("worlds", args.world);
  if (!path) return tl::unexpected(path.error());
  Result<World> world = read_world(*path);
  if (!world) return tl::unexpected(world.error());
  job.truth = std::move(*world);
  return job;
}

/// The maps that are named, and what is said of their tags.
Status read_maps(const MapArgs& args, MapJob& job) {
  if (!args.prior.empty()) {
    Result<LandmarksFile> prior = read_landmarks(args.prior, args.tag_size_m);
    if (!prior) return tl::unexpected(prior.error());
    job.prior = std::move(*prior);
  }
  return read_extension(args.extend, args.route_name, args.freeze, args.remove, job);
}

Result<MapSceneJob> scene_job_of(const MapArgs& args) {
  BundleMapOptions bundle;
  if (Status status = args.bundle.apply(bundle); !status) return tl::unexpected(status.error());
  const std::vector<std::string> models = {"waymark", "tagslam"};
  if (std::ranges::find(models, args.model) == models.end())
    return fail(ErrorCode::InvalidArgument, fmt::format("there is no model '{}'", args.model),
                {.key = "--model"}, suggestion(args.model, models));
  return MapSceneJob{.recording = args.lap,
                     .tagslam = args.tagslam,
                     .folder = args.folder,
                     .against = args.against,
                     .options = {.model = args.model == "tagslam" ? SceneModel::Tagslam : SceneModel::Waymark,
                                 .search = bundle.search}};
}

/// With TagSLAM's files: no floor, any number of cameras and bodies.
ExitCode map_tagslam(const MapArgs& args, Console& console) {
  const Result<MapSceneJob> job = scene_job_of(args);
  if (!job) {
    console.say(naming_flag(job.error()));
    return ExitCode::Usage;
  }
  const Result<MapSceneReport> report = map_scene_recording(*job, control_from(console));
  if (!report) {
    console.say(report.error());
    return interrupted() ? ExitCode::Interrupted : ExitCode::SomeFailed;
  }
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report, args.folder));
  for (const std::string& warning : report->warnings) console.say("warning: " + warning);
  return ExitCode::Ok;
}

/// Flags that scenes have no use for.
Status check_tagslam_flags(const CLI::App& app) {
  const std::vector<std::string> known = {"LAP",  "output", "tagslam",      "model",       "against",
                                          "json", "help",   "outlier-chi2", "robust-chi2", "max-iterations"};
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_single_name();
    if (option->count() > 0 && std::ranges::find(known, name) == known.end())
      return fail(ErrorCode::InvalidArgument, "this has no effect on scenes that TagSLAM's files describe",
                  {.key = option->get_name()}, "Leave it out, or leave out --tagslam.");
  }
  return {};
}

/// What is missing (a verb with verbs of its own cannot leave that to the parser), and flags that would be
/// passed over in silence.
Status check_flags(const MapArgs& args) {
  const auto only_with_tagslam = [](const char* flag) {
    return fail(ErrorCode::InvalidArgument, "this is about scenes that TagSLAM's files describe",
                {.key = flag}, "Give their folder with --tagslam, or leave it out.");
  };
  if (args.lap.empty())
    return fail(ErrorCode::InvalidArgument, "LAP is required: a recording, or the verb 'convert'");
  if (args.folder.empty()) return fail(ErrorCode::InvalidArgument, "--output is required");
  if (!args.tagslam.empty()) return check_tagslam_flags(args.app);
  if (args.model != "waymark") return only_with_tagslam("--model");
  if (!args.against.empty()) return only_with_tagslam("--against");
  return {};
}

ExitCode map(const MapArgs& args, Console& console) {
  if (Status status = check_flags(args); !status) {
    console.say(naming_flag(status.error()));
    return ExitCode::Usage;
  }
  if (!args.tagslam.empty()) return map_tagslam(args, console);
  Result<MapJob> job = job_of(args);
  const Status maps = job ? read_maps(args, *job) : tl::unexpected(job.error());
  if (!maps) {
    console.say(naming_flag(maps.error()));
    return job ? exit_code_of(maps.error()) : ExitCode::Usage;
  }
  std::optional<TagFinder> finder;
  if (args.detector.given()) {
    Result<TagFinder> made = args.detector.make();
    if (!made) {
      console.say(naming_flag(made.error()));
      return ExitCode::Usage;
    }
    finder = std::move(*made);
    job->finder = &*finder;
  }
  const Result<MapReport> report = map_recording(*job, control_from(console));
  if (!report) {
    console.say(report.error());
    return interrupted() ? ExitCode::Interrupted : ExitCode::SomeFailed;
  }
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report, args.folder));
  for (const std::string& warning : report->warnings) console.say("warning: " + warning);
  return ExitCode::Ok;
}

Run prepare_map(CLI::App& app) {
  const auto args = std::make_shared<MapArgs>(app);
  app.add_option("LAP", args->lap, "Recording of a taught lap, or with --tagslam of tags and odometry")
      ->type_name("");
  app.add_option("MORE", args->more,
                 "Further files of the same lap: tables of odometry or of an IMU, parts of a bag")
      ->type_name("");
  app.add_option("--robot", args->robot,
                 "Camera and where it sits: a robot's file, or a name. Unless given: what the recording says")
      ->type_name("FILE");
  add_frame_flags(app, args->frames);
  app.add_option("-o,--output", args->folder, "Folder for the map, the route and the figures")
      ->type_name("FOLDER");
  app.add_option("--method", args->method,
                 "How tags are placed: bundle, everything seen and driven explained at once; chain, from tag "
                 "to tag, nothing "
                 "optimised")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option("--anchor", args->anchor,
                 "The tag the map is placed by, for example tag36h11:0. Unless given: that of the recording")
      ->type_name("TAG");
  app.add_option("--anchor-pose", args->anchor_pose,
                 "Where the anchor stands in the map: x y z [m] and roll pitch yaw [deg] of the tag's frame "
                 "(x right, y "
                 "down, z into the tag). Unless given: that of the recording; for another anchor the map's "
                 "origin is its centre, map z is up, map x goes into the tag")
      ->expected(6)
      ->type_name("X Y Z ROLL PITCH YAW");
  app.add_option("--tag-size-m", args->tag_size_m,
                 "Side of the black square of the tags, in metres. Unless given: that of the recording")
      ->type_name("NUMBER");
  app.add_option("--world", args->world, "The truth about the tags, where the recording does not hold it")
      ->type_name("NAME");
  app.add_option(
         "--prior", args->prior,
         "An older map of the place (map.yaml, or any that `waymark localize --map` takes): which tags were "
         "swapped, moved, resized since is said")
      ->type_name("FILE");
  app.add_option("--extend", args->extend,
                 "A map (map.yaml, or its folder) that this lap is to improve: the lap is moved onto it, and "
                 "both are "
                 "adjusted together; what the lap did not see stays. The older one is kept")
      ->type_name("MAP");
  app.add_option(
         "--route-name", args->route_name,
         "With --extend: the lap becomes the route of this name (route-NAME.yaml) beside those of the "
         "map, which stay")
      ->type_name("NAME");
  app.add_option("--freeze", args->freeze,
                 "With --extend: tags that stay exactly where the map has them, such as 3,7 or tag36h11:3")
      ->delimiter(',')
      ->type_name("TAGS");
  app.add_option("--remove", args->remove, "With --extend: tags that are gone, from the map and from the lap")
      ->delimiter(',')
      ->type_name("TAGS");
  app.add_option("--map-sigma", args->map_sigma_m,
                 "With --extend: how well the tags are known of a map that does not say it of any, such as "
                 "one measured by hand [m]")
      ->capture_default_str()
      ->check(CLI::Range(1e-6, 10.0))
      ->type_name("NUMBER");
  app.add_option("--tagslam", args->tagslam,
                 "A folder with TagSLAM's tagslam.yaml, cameras.yaml and camera_poses.yaml (or a "
                 "config.json): cameras and "
                 "bodies are as they say, no floor is needed")
      ->type_name("FOLDER");
  app.add_option("--model", args->model,
                 "With --tagslam, what is minimised: waymark; tagslam, every sighting with TagSLAM's noise "
                 "and cameras "
                 "that wiggle")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option("--against", args->against,
                 "With --tagslam, another solution (ref_static.csv, ref_trajectory.csv): both are about its "
                 "frames and "
                 "tags, and its cost is printed")
      ->type_name("FOLDER");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return map(*args, console); };
}

}  // namespace

Verb map_verb() {
  return {
      .name = "map",
      .sentence = "Make a map of the tags and a route of a recorded lap",
      .help =
          R"(Writes map.yaml (tags), route.yaml (what to drive), trajectory.txt (where the base was, TUM format),
summary.json (what --json prints) and figures into the folder; robot.yaml and truth_trajectory.txt where
the recording holds them; trajectory_covariance.csv with method bundle. What stands in the folder under these
names moves aside (map.1.yaml, error.1.svg, ...); a run writes all of its files or none. Formats: docs/formats/map.md.
A recording that was cut is used as far as it goes. Where it holds pictures instead of tags, their tags are found first;
the detector's flags say how, and that the pictures count also where the recording holds tags.
Where the truth is known, errors are printed: in the frame the anchor gives, without any alignment.

With --extend MAP a lap improves a map that is there: what both know is weighed by their covariances, tags that
are not where the map has them are named and get their new place, tags the lap did not see stay. With
--route-name NAME the lap is one more route of that map: `waymark replay MAP --route NAME` drives it.
A recording that holds poses of tags and no corners (an LCM log of an MBot) is mapped with its odometry, in the
frame of the base where it begins.

With --tagslam FOLDER the recording is of any cameras on any bodies that look at tags on any bodies, as TagSLAM's
files in that folder say; no floor, wheels or route are needed. It writes map.yaml (tags of bodies that stand still),
trajectory_BODY.txt of each body that moves, poses.yaml and camera_poses.yaml as TagSLAM reads them, and summary.json
(docs/formats/tagslam.md).

Exit code: 0 a map was made (doubts are warnings), 1 none could be made or written, 2 wrong usage, 130 Ctrl-C.

Examples:
  waymark map lap.mcap -o map
  waymark map lap.mcap -o map2 --method chain --smoothing-m 0.2 --json
  waymark map lap.mcap -o map3 --anchor tag36h11:0 --anchor-pose 0 0 0.3 -90 0 -90
  waymark map lap2.mcap -o map --extend map --remove 7
  waymark map lap3.mcap -o map --extend map --route-name kitchen
  waymark map bag --camera-frame camera_color_optical_frame --tag-size-m 0.16 --anchor 0 -o map
  waymark map detections.csv odometry.csv --robot limo --tag-size-m 0.16 --anchor 0 -o map
  waymark map tags.bag --tagslam config -o scene
)",
      .prepare = prepare_map,
      .verbs = {map_convert_verb()}};
}

}  // namespace waymark::cli

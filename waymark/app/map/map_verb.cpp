#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include <CLI/App.hpp>

#include "waymark/app/cli/detection_flags.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/map/map_words.hpp"
#include "waymark/app/video/map_video.hpp"

namespace waymark::cli {
namespace {

/// The flags of `waymark map`. Must stay where it is while the command line is parsed.
struct MapArgs : MapWords {
  explicit MapArgs(CLI::App& verb);

  Settings settings;
  bool json = false;
  OptionFlags<BundleMapOptions> bundle;
  OptionFlags<ChainOptions> chain;
  OptionFlags<LandmarkMapOptions> points;
  OptionFlags<RouteOptions> route;
  DetectorFlags detector;

  /// What is missing (a verb with verbs of its own cannot leave that to the parser), and flags that would be
  /// passed over in silence.
  [[nodiscard]] Status check() const;
  /// Without the maps that are named.
  [[nodiscard]] Result<MapJob> make_job() const;
  /// Refuses options of laps of a robot, where the map is made of something else.
  void refuse_lap_options(Refusals& refused, const char* why, const char* hint) const;
  /// Prints the report of a map and its warnings.
  [[nodiscard]] ExitCode show(const auto& report, Console& console) const {
    console.print(json ? json_line(to_json(report)) : to_text(report, job.folder));
    console.warn(report.warnings);
    return ExitCode::Ok;
  }
  /// With --tagslam.
  [[nodiscard]] Result<MapSceneJob> make_scene_job() const;
};

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

void MapArgs::refuse_lap_options(Refusals& refused, const char* why, const char* hint) const {
  for (const char* key : {"estimate_noise", "find_mounting", "keep_mounting"})
    refused.options(true, bundle, why, hint, key);
  for (const std::string& key : field_names<LapModelOptions>()) refused.options(true, bundle, why, hint, key);
  refused.options(true, chain, why, hint);
  refused.options(true, points, why, hint);
  refused.options(true, route, why, hint);
}

Status MapArgs::check() const {
  if (Status sound = check_effects(*this, given_on(settings.app())); !sound) return sound;
  if (!scene.tagslam.empty()) return check_tagslam_flags(*this);
  Refusals refused(settings.app());
  refused.options(of.method == "chain", bundle, "the method chain does not optimise",
                  "Leave it out, or --method chain.");
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
  BundleMapOptions options;
  const Status status = bundle.apply(options);
  return status ? described_scene(*this, options.search) : tl::unexpected(status.error());
}

MapArgs::MapArgs(CLI::App& verb)
    : settings(verb),
      bundle(settings, "bundle", "Method bundle"),
      chain(settings, "chain", "Where the search starts, and method chain"),
      points(settings, "points", "Recordings with poses of tags and no corners"),
      route(settings, "route", "Route"),
      detector(settings, "Detector") {
  add_fields(verb, static_cast<MapWords&>(*this));
  verb.add_flag("--json", json, "One JSON object instead of words");
}

struct MapArgs;

/// The flags of `waymark map` that are about videos. Must stay where it is while the command line is parsed.
class MapVideoFlags {
 public:
  explicit MapVideoFlags(CLI::App& app);

  /// Whether the lap is a video.
  [[nodiscard]] bool takes(const MapArgs& args) const;
  /// Maps the tags of videos, and says what became of it.
  [[nodiscard]] ExitCode map(const MapArgs& args, Console& console) const;

 private:
  [[nodiscard]] Result<MapVideoJob> job_of(const MapArgs& args) const;

  CLI::App& app_;
  MapVideoDescription of_{};
};

MapVideoFlags::MapVideoFlags(CLI::App& app) : app_(app) { add_fields(app, of_); }

bool MapVideoFlags::takes(const MapArgs& args) const {
  return is_of_camera(args.job.lap, app_.count("--camera") > 0);
}

Result<MapVideoJob> MapVideoFlags::job_of(const MapArgs& args) const {
  MapVideoDescription of = of_;
  of.anchor = args.of.anchor;
  of.prior = args.of.prior;
  Refusals refused(app_);
  args.refuse_lap_options(refused, kNotOfVideos, kNoRobot);
  Status sound = check_effects(of, given_on(app_));
  if (sound) sound = refused.status();
  if (!sound) return tl::unexpected(sound.error());
  const Result<MapJob> common = args.make_job();
  if (!common) return tl::unexpected(common.error());
  return described_map_video(of, *common);
}

ExitCode MapVideoFlags::map(const MapArgs& args, Console& console) const {
  const Result<MapVideoJob> job = job_of(args);
  if (!job) return fail_with(job.error(), console);
  const Result<TagFinder> finder = args.detector.make();
  if (!finder) return fail_usage(finder.error(), console);
  const Result<MapVideoReport> report = map_video(*job, *finder, control_from(console));
  if (!report) return console.failed(report.error(), ExitCode::SomeFailed);
  return args.show(*report, console);
}

struct MapVerbArgs : MapArgs {
  explicit MapVerbArgs(CLI::App& app) : MapArgs(app), video(app) {}

  MapVideoFlags video;
};

/// With TagSLAM's files: no floor, any number of cameras and bodies.
ExitCode map_tagslam(const MapArgs& args, Console& console) {
  const Result<MapSceneJob> job = args.make_scene_job();
  if (!job) return fail_usage(job.error(), console);
  const Result<MapSceneReport> report = map_scene_recording(*job, control_from(console));
  if (!report) return console.failed(report.error(), ExitCode::SomeFailed);
  return args.show(*report, console);
}

ExitCode map(const MapVerbArgs& args, Console& console) {
  if (Status status = args.check(); !status) return fail_usage(status.error(), console);
  if (args.video.takes(args)) return args.video.map(args, console);
  if (Status status = check_no_video(given_on(args.settings.app())); !status)
    return fail_usage(status.error(), console);
  if (!args.scene.tagslam.empty()) return map_tagslam(args, console);
  Result<MapJob> job = args.make_job();
  if (!job) return fail_usage(job.error(), console);
  if (const Status maps = read_described_maps(args.of, *job); !maps) return fail_with(maps.error(), console);
  std::optional<TagFinder> finder;
  if (args.detector.given()) {
    Result<TagFinder> made = args.detector.make();
    if (!made) return fail_usage(made.error(), console);
    finder = std::move(*made);
    job->finder = &*finder;
  }
  const Result<MapReport> report = map_recording(*job, control_from(console));
  if (!report) return console.failed(report.error(), ExitCode::SomeFailed);
  return args.show(*report, console);
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

A video (mp4, mkv, webm, avi) of a camera that is carried by hand is mapped without robot, odometry and floor, in six
degrees of freedom; --camera and --tag-size-m are needed. Tags must be in one picture with tags that lead to the anchor.
It writes map.yaml, layout.json (WPILib, PhotonVision), layout.fmap (Limelight), poses.yaml (TagSLAM), trajectory.txt
(of the camera) and summary.json. With --prior the anchor stands where that map has it, and each tag is held against it;
with --prior-sigma-m all its tags hold the map. Scale: --tag-size-m, or measured distances (--distance); level: the
anchor, or tags known to hang upright or to lie on the floor (--upright, --floor). docs/howto/video.md says more.

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
  waymark map walk.mp4 --camera calibration.yaml --tag-size-m 0.165 -o map
  waymark map walk.mp4 --camera calibration.yaml --tag-size-m 0.165 -o map --distance 3,7,2.41 --upright 3,7,9
)",
      .prepare = prepared(map),
      .verbs = {map_convert_verb()}};
}

}  // namespace waymark::cli

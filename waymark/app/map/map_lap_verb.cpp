#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/App.hpp>

#include "waymark/app/cli/detection_flags.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/map/map_extension.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/yaml/world_file.hpp"

namespace waymark::cli {
namespace {

/// The flags of `waymark map lap`. Must not be moved in memory while the command line is parsed.
struct MapLapArgs {
  explicit MapLapArgs(CLI::App& verb);

  /// Builds the job from the flags: method, options, anchor, tag sizes and ground truth.
  [[nodiscard]] Result<MapJob> make_job() const;
  /// Reads the prior map and the map to be extended, and stores both in the job made by make_job().
  [[nodiscard]] Status read_maps(MapJob& made) const;

  MapJob job{};
  Settings settings;
  std::string method = "bundle";
  std::vector<double> anchor_pose;
  std::vector<std::string> tag_sizes;
  std::string world;
  std::string prior;
  std::string extend;
  std::vector<std::string> freeze;
  std::vector<std::string> remove;
  bool json = false;
  OptionFlags<BundleMapOptions> bundle;
  OptionFlags<ChainOptions> chain;
  OptionFlags<LandmarkMapOptions> points;
  OptionFlags<RouteOptions> route;
  DetectorFlags detector;
};

MapLapArgs::MapLapArgs(CLI::App& verb)
    : settings(verb),
      bundle(settings, "bundle", "Method bundle"),
      chain(settings, "chain", "Initial estimate, and method chain"),
      points(settings, "points", "Recordings with tag poses but no corners"),
      route(settings, "route", "Route"),
      detector(settings, "Detector") {
  add_fields(verb, job);
  add_option(verb, "--anchor-pose X Y Z ROLL PITCH YAW", anchor_pose,
             "Pose of the anchor in the map: x y z [m] and roll pitch yaw [deg] of the tag frame (x "
             "right, y down, z into the tag). Default: from the recording. For another anchor, the map "
             "origin is its centre, map z points up and map x into the tag",
             exactly(6));
  add_option(verb, "--tag-size-m SIZE", tag_sizes,
             "Side of the black square of the tags [m]; ID=SIZE for a tag of a different size (repeatable). "
             "Default: from the recording")
      ->allow_extra_args(false);
  add_option(verb, "--method NAME", method,
             "Mapping method: bundle (bundle adjustment of all observations and odometry) or chain (tag to "
             "tag, without optimisation)",
             kShown);
  add_option(verb, "--world NAME", world,
             "World with the true tag poses, if the recording does not contain it");
  add_option(verb, "--prior FILE", prior,
             "Older map of the same place for comparison (map.yaml, or any format accepted by `waymark "
             "localize --map`): tags that have since been swapped, moved or resized are listed");
  add_option(verb, "--extend MAP", extend,
             "Map (map.yaml or its folder) that this lap improves: both are aligned and adjusted together. "
             "Tags that are not observed in the lap are kept. The older map is backed up");
  add_option(verb, "--route-name NAME", job.route_name,
             "With --extend: save the lap as a route with this name (route-NAME.yaml); the other routes of "
             "the map are kept");
  add_option(verb, "--freeze TAGS", freeze,
             "With --extend: tags whose pose in the map is kept exactly, such as 3,7 or tag36h11:3",
             kByCommas, kMore);
  add_option(verb, "--remove TAGS", remove,
             "With --extend: tags that no longer exist; they are deleted from the map and from the lap",
             kByCommas, kMore);
  add_option(verb, "--map-sigma NUMBER", job.map_sigma_m,
             "With --extend: standard deviation of the tag positions of a map without covariances, such as "
             "one measured by hand [m]",
             kMore, between(1e-6, 10.0))
      ->default_str(fmt::format("{}", kMapSigma_m));
  add_flag(verb, "--json", json, "Print one JSON object instead of text");
}

Result<MapJob> MapLapArgs::make_job() const {
  MapJob made = job;
  Refusals refused(settings.app());
  refused.options(method == "chain", bundle, "method chain does not optimise",
                  "Omit this option or `--method chain`.");
  Status status = refused.status();
  if (status) status = bundle.apply(made.options.bundle);
  if (status) status = chain.apply(made.options.chain);
  if (status) status = points.apply(made.points);
  if (status) status = route.apply(made.options.route);
  if (!status) return tl::unexpected(status.error());
  const Result<MapMethod> by = parse_map_method(method);
  if (!by) return tl::unexpected(by.error());
  made.options.method = *by;
  // Recorded detections may be of any family, so setup_of() checks the families of these sizes.
  const auto families = detector.given() ? detector.families() : std::vector<FamilyId>();
  if (!families) return tl::unexpected(families.error());
  const Result<TagSizes> sizes = parse_tag_sizes(tag_sizes, *families);
  if (!sizes) return tl::unexpected(sizes.error());
  made.overrides.tag_size_m = sizes->default_size_m;
  made.overrides.size_by_tag_m = sizes->size_by_tag_m;
  if (!anchor_pose.empty()) {
    const Result<SE3> pose = anchor_pose_of(anchor_pose);
    if (!pose) return tl::unexpected(pose.error());
    made.overrides.map_T_anchor = *pose;
  }
  if (world.empty()) return made;
  const auto path = find_shared("worlds", world);
  if (!path) return tl::unexpected(path.error());
  Result<World> truth = or_wrong_kind(read_world(*path), *path, FileUse::World);
  if (!truth) return tl::unexpected(truth.error());
  made.truth = std::move(*truth);
  return made;
}

Status MapLapArgs::read_maps(MapJob& made) const {
  if (!prior.empty()) {
    Result<LandmarksFile> older =
        or_wrong_kind(read_landmarks(prior, made.overrides.tag_size_m), prior, FileUse::Map);
    if (!older) return tl::unexpected(older.error());
    made.prior = std::move(*older);
  }
  if (!extend.empty())
    if (Status read = read_extended_map(extend, made); !read) return read;
  const auto frozen = tags_named(freeze, "freeze");
  const auto removed = tags_named(remove, "remove");
  if (!frozen || !removed) return tl::unexpected((frozen ? removed : frozen).error());
  made.freeze = {frozen->begin(), frozen->end()};
  made.remove = {removed->begin(), removed->end()};
  return check(made);
}

ExitCode map_lap(const MapLapArgs& args, Console& console) {
  Result<MapJob> job = args.make_job();
  if (!job) return fail_usage(job.error(), console);
  if (const Status maps = args.read_maps(*job); !maps) return fail_with(maps.error(), console);
  std::optional<TagFinder> finder;
  if (args.detector.given()) {
    Result<TagFinder> made = args.detector.make();
    if (!made) return fail_usage(made.error(), console);
    finder = std::move(*made);
    job->finder = &*finder;
  }
  const Result<MapReport> report = map_recording(*job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report, job->folder));
  console.warn(report->warnings);
  return ExitCode::Ok;
}

}  // namespace

Verb map_lap_verb() {
  return {
      .name = "lap",
      .sentence = "Make a tag map and a route from a robot's recorded lap",
      .help =
          R"(Writes map.yaml (tags), route.yaml (the path to repeat), trajectory.txt (poses of the base, TUM format), summary.json
(the output of --json) and figures into the folder. If the recording contains the data, robot.yaml and
truth_trajectory.txt are written as well, and with method bundle also trajectory_covariance.csv. Existing files with
these names are kept as backups (map.1.yaml, error.1.svg, ...). Either all files are written or none. Formats:
docs/formats/map.md.
A truncated recording is used up to its end. If it contains images but no tags, the tags are detected first. With any
detector flag, tags are detected in the images even if the recording already contains tags.
If the ground truth is known, errors are printed in the frame of the anchor, without alignment.
The camera is read from the recording; set --robot if the recording has no calibration.

With --extend MAP, a lap improves an existing map: both are weighted by their covariances. Tags that have moved are
reported, and their poses are updated; tags that are not observed in the lap are kept. The map already has an anchor, so
--anchor and --anchor-pose are not allowed. With --route-name NAME, the lap becomes an additional route of that map:
`waymark replay MAP --route NAME` drives it.
A recording with tag poses but no corners (such as an LCM log from an MBot) is mapped using its odometry. The map frame
is then that of the base at the start of the lap.

Exit code: 0 map written (possibly with warnings), 1 no map could be made or written, 2 wrong usage, 130 Ctrl-C.

Examples:
  waymark map lap.mcap -o map
  waymark map lap.mcap -o map2 --method chain --smoothing-m 0.2 --json
  waymark map lap.mcap -o map3 --anchor tag36h11:0 --anchor-pose 0 0 0.3 -90 0 -90
  waymark map lap2.mcap -o map --extend map --remove 7
  waymark map lap3.mcap -o map --extend map --route-name kitchen
  waymark map bag --camera-frame camera_color_optical_frame --tag-size-m 0.16 --anchor 0 -o map
  waymark map detections.csv odometry.csv --robot limo --tag-size-m 0.16 --anchor 0 -o map
)",
      .prepare = prepared(map_lap),
      .report = report_of<MapReport>};
}

}  // namespace waymark::cli

#include <string>
#include <utility>
#include <vector>

#include <CLI/App.hpp>

#include "waymark/app/cli/detection_flags.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/video/map_video.hpp"

namespace waymark::cli {
namespace {

/// The flags of `waymark map video`. Must not be moved in memory while the command line is parsed.
struct MapVideoArgs {
  explicit MapVideoArgs(CLI::App& verb);

  [[nodiscard]] Result<MapVideoJob> make_job() const;

  MapVideoJob job{};
  Settings settings;
  CameraDescription camera;
  std::vector<std::string> tag_sizes;
  std::string anchor;
  std::vector<double> anchor_pose;
  std::string prior;
  std::vector<std::string> distances;
  std::vector<std::string> upright;
  std::vector<std::string> floor;
  std::vector<std::string> planes;
  bool json = false;
  OptionFlags<SearchOptions> search;
  DetectorFlags detector;

 private:
  [[nodiscard]] Status read_place(MapVideoJob& made) const;
  [[nodiscard]] Status read_camera_file(MapVideoJob& made) const;
};

MapVideoArgs::MapVideoArgs(CLI::App& verb)
    : settings(verb), search(settings, "bundle", "Bundle adjustment"), detector(settings, "Detector") {
  add_fields(verb, job);
  add_option(verb, "--camera FILE", camera.file,
             "Camera calibration (calibration.yaml, ROS camera_info, kalibr YAML or PhotonVision JSON), "
             "required; standard deviations in a calibration.yaml are included in the map's covariance");
  CameraDescription::fields(camera,
                            [&](auto& value, const JobField& field) { add_field(verb, value, field); });
  add_option(verb, "--readout-ms NUMBER", camera.readout_ms,
             "Readout time of the rolling shutter from the first row to the last, in milliseconds; negative "
             "if rows are read from the bottom. Default: that in a calibration.yaml, else 0",
             between(-200.0, 200.0));
  add_option(verb, "--tag-size-m SIZE", tag_sizes,
             "Side of the black square of the tags [m], required; ID=SIZE for a tag of a different size "
             "(repeatable)")
      ->allow_extra_args(false);
  add_option(verb, "--anchor TAGS", anchor,
             "Anchor tag, which defines the map frame, for example tag36h11:0; with --prior also several "
             "(3,7,9). Default: the tag with the most observations");
  add_option(verb, "--anchor-pose X Y Z ROLL PITCH YAW", anchor_pose,
             "Pose of the anchor in the map: x y z [m] and roll pitch yaw [deg] of the tag frame (x "
             "right, y down, z into the tag). Default: from --prior. Without --prior, the map origin is its "
             "centre, map z points up and map x into the tag",
             exactly(6));
  add_option(verb, "--prior FILE", prior,
             "Older map of the same place (map.yaml, or any format accepted by `waymark localize --map`). It "
             "defines the anchor pose and is compared with the new map");
  add_option(
      verb, "--distance TAG,TAG,METRES", distances,
      "Measured distance between the centres of two tags, which sets the scale: ids, metres and optionally a "
      "standard deviation (default 0.005 m), such as 3,7,2.41 or 3,7,2.41,0.002 (repeatable)");
  add_option(verb, "--upright TAGS", upright,
             "Tags that hang upright on vertical walls, such as 3,7; they level the map", kByCommas);
  add_option(verb, "--floor TAGS", floor, "Tags that lie on the floor; they level the map and define z = 0",
             kByCommas);
  add_option(verb, "--plane TAGS", planes,
             "Tags in one plane with an unknown pose, such as one wall: 3,4,7 (repeatable)");
  add_flag(verb, "--json", json, "Print one JSON object instead of text");
}

Status MapVideoArgs::read_place(MapVideoJob& made) const {
  const auto families = detector.families();
  if (!families) return tl::unexpected(families.error());
  Result<TagSizes> sizes = parse_tag_sizes(tag_sizes, *families);
  if (!sizes) return tl::unexpected(sizes.error());
  made.sizes = std::move(*sizes);
  Status status;
  const auto read = [&](const std::vector<std::string>& texts, const char* field, std::vector<TagId>& tags) {
    Result<std::vector<TagId>> named = tags_named(texts, field, *families);
    if (status && !named) status = tl::unexpected(named.error());
    if (named) tags = std::move(*named);
  };
  if (!anchor.empty()) read({anchor}, "anchor", made.anchors);
  read(upright, "upright", made.upright);
  read(floor, "floor", made.floor);
  for (const std::string& plane : planes) read({plane}, "plane", made.planes.emplace_back());
  if (!status) return status;
  for (const std::string& text : distances) {
    const Result<MeasuredDistance> distance = parse_distance(text, *families);
    if (!distance) return tl::unexpected(distance.error());
    made.distances.push_back(*distance);
  }
  if (anchor_pose.empty()) return {};
  const Result<SE3> pose = anchor_pose_of(anchor_pose);
  if (!pose) return tl::unexpected(pose.error());
  made.map_T_anchor = *pose;
  return {};
}

Status MapVideoArgs::read_camera_file(MapVideoJob& made) const {
  if (camera.file.empty()) return {};
  Result<DescribedCamera> read = read_camera(camera);
  if (!read) return tl::unexpected(read.error());
  made.camera = read->camera;
  made.intrinsics_sigma = std::move(read->intrinsics_sigma);
  made.readout_s = read->readout_s;
  return {};
}

Result<MapVideoJob> MapVideoArgs::make_job() const {
  MapVideoJob made = job;
  Status status = search.apply(made.search);
  if (status) status = read_place(made);
  if (status) status = read_camera_file(made);
  if (status && !prior.empty()) status = read_prior_map(prior, made);
  if (status) status = check(made);
  return status ? Result<MapVideoJob>(std::move(made)) : tl::unexpected(status.error());
}

ExitCode map_video_tags(const MapVideoArgs& args, Console& console) {
  const Result<MapVideoJob> job = args.make_job();
  if (!job) return fail_with(job.error(), console);
  const Result<TagFinder> finder = args.detector.make();
  if (!finder) return fail_usage(finder.error(), console);
  const Result<MapVideoReport> report = map_video(*job, *finder, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report, job->folder));
  console.warn(report->warnings);
  return ExitCode::Ok;
}

}  // namespace

Verb map_video_verb() {
  return {
      .name = "video",
      .sentence = "Make a tag map from the video of a hand-held camera",
      .help =
          R"(Makes a map from a video (mp4, mkv, webm, avi), or from the recording of a camera alone. Tags have six degrees of
freedom; no robot, odometry or floor is needed. The flags --camera and --tag-size-m are required. Each tag must be in an
image together with a tag connected to the anchor. It writes map.yaml, layout.json (WPILib, PhotonVision), layout.fmap
(Limelight), poses.yaml (TagSLAM), trajectory.txt (of the camera) and summary.json. With --prior, that map defines the
anchor pose, and all tags are compared with it; with --prior-sigma-m, all its tags define the map frame. The scale is
set by --tag-size-m or by measured distances (--distance). The map is levelled by the anchor, or by tags known to be
upright or to lie on the floor (--upright, --floor). See docs/howto/video.md. For a recording with odometry, use
`waymark map lap`, which also makes a route.

Exit code: 0 map written (possibly with warnings), 1 no map could be made or written, 2 wrong usage, 130 Ctrl-C.

Examples:
  waymark map walk.mp4 --camera calibration.yaml --tag-size-m 0.165 -o map
  waymark map walk.mp4 --camera calibration.yaml --tag-size-m 0.165 -o map --distance 3,7,2.41 --upright 3,7,9
  waymark map video desk.mcap --camera calibration.yaml --tag-size-m 0.16 -o map
)",
      .prepare = prepared(map_video_tags),
      .report = report_of<MapVideoReport>};
}

}  // namespace waymark::cli

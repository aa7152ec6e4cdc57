#include <string>

#include <CLI/App.hpp>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/scene/map_scene.hpp"

namespace waymark::cli {
namespace {

/// The flags of `waymark map scene`. Must not be moved in memory while the command line is parsed.
struct MapSceneArgs {
  explicit MapSceneArgs(CLI::App& verb) : settings(verb), search(settings, "bundle", "Bundle adjustment") {
    add_fields(verb, job);
    add_option(verb, "--model NAME", model,
               "Cost model: waymark, or tagslam (TagSLAM's noise for observations and camera poses)", kShown);
    add_flag(verb, "--json", json, "Print one JSON object instead of text");
  }

  MapSceneJob job{};
  Settings settings;
  std::string model = "waymark";
  bool json = false;
  OptionFlags<SearchOptions> search;
};

ExitCode map_scene(const MapSceneArgs& args, Console& console) {
  MapSceneJob job = args.job;
  Status status = args.search.apply(job.options.search);
  if (const Result<SceneModel> model = parse_scene_model(args.model); model)
    job.options.model = *model;
  else if (status)
    status = tl::unexpected(model.error());
  if (status) status = check(job);
  if (!status) return fail_usage(status.error(), console);
  const Result<MapSceneReport> report = map_scene_recording(job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report, job.folder));
  console.warn(report->warnings);
  return ExitCode::Ok;
}

}  // namespace

Verb map_scene_verb() {
  return {
      .name = "scene",
      .sentence = "Map cameras and tagged bodies described by TagSLAM's files",
      .help =
          R"(Maps a scene in which cameras on any bodies observe tags on any bodies, as described by the TagSLAM files in --tagslam.
No floor, wheels or route are needed. Tag sizes, the anchor (a static body) and cameras are read from these files, so
this verb has no flags for them. It writes map.yaml (tags on static bodies), trajectory_BODY.txt for each moving body,
poses.yaml and camera_poses.yaml in TagSLAM's format, and summary.json (docs/formats/tagslam.md). The recording is a bag
or an MCAP file with detections; tags are not detected in images.

Exit code: 0 map written (possibly with warnings), 1 no map could be made or written, 2 wrong usage, 130 Ctrl-C.

Examples:
  waymark map tags.bag --tagslam config -o scene
  waymark map scene tags.bag --tagslam config -o scene --free-intrinsics
  waymark map tags.bag --tagslam config -o scene --model tagslam --against reference --json
)",
      .prepare = prepared(map_scene),
      .report = report_of<MapSceneReport>};
}

}  // namespace waymark::cli

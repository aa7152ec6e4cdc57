#include <algorithm>
#include <string>

#include "waymark/app/cli/verb.hpp"
#include "waymark/app/common/file_kind.hpp"

namespace waymark::cli {
namespace {

/// The subcommand for a command line that does not name one. It is implied by --tagslam or --camera, or else
/// by the content of the files.
std::string implied_subcommand(const std::vector<std::string>& words) {
  if (has_word(words, "--tagslam")) return "scene";
  const auto is_video = [](const std::string& word) { return kind_of(word) == FileKind::Video; };
  return has_word(words, "--camera") || std::ranges::any_of(words, is_video) ? "video" : "lap";
}

}  // namespace

Verb map_verb() {
  return {
      .name = "map",
      .sentence = "Make a tag map, and a route, from a recorded lap, a video or a scene",
      .help =
          R"(`waymark map lap` maps a robot's lap: tag corners (or poses) and odometry become a map, a route and figures.
`waymark map video` maps tags from the video of a hand-held camera, in six degrees of freedom, without robot or odometry.
`waymark map scene` maps a scene described by TagSLAM's files, with any cameras on any bodies, and without a floor.
`waymark map convert` converts a map between Waymark's format and those of other programs.

The subcommand may be omitted: with --tagslam it is `scene`; with --camera, or if a file is a video,
`video`; else `lap`. `waymark map FILE --help` prints the flags of the selected subcommand. A file or folder named lap,
video, scene or convert must be given with its path: ./lap.

Examples:
  waymark map lap.mcap -o map
  waymark map walk.mp4 --camera calibration.yaml --tag-size-m 0.165 -o map
  waymark map tags.bag --tagslam config -o scene
  waymark map convert map layout.json --to wpilib
)",
      .verbs = {map_lap_verb(), map_video_verb(), map_scene_verb(), map_convert_verb()},
      .usual_verb = implied_subcommand};
}

}  // namespace waymark::cli

#include <algorithm>
#include <string>
#include <vector>

#include "waymark/app/cli/verb.hpp"
#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/app/live/robot_kinds.hpp"

namespace waymark::cli {
namespace {

/// The value of a flag given as "--robot ros2:limo" or "--robot=ros2:limo". Empty if the flag is not given.
std::string value_of(const std::vector<std::string>& words, const std::string& flag) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i].starts_with(flag + "=")) return words[i].substr(flag.size() + 1);
    if (words[i] == flag && i + 1 < words.size()) return words[i + 1];
  }
  return {};
}

/// The subcommand implied by a command line that does not name one.
std::string implied_subcommand(const std::vector<std::string>& words, const std::vector<Verb>& verbs) {
  if (is_robot_kind(value_of(words, "--robot"))) return "robot";
  const std::vector<std::string> inputs = inputs_of(words, verbs);
  const bool calibrated = has_word(words, "--camera");
  if (std::ranges::any_of(inputs, is_camera_address)) return "camera";
  const auto filmed = [&](const std::string& input) { return is_of_camera(input, calibrated); };
  return std::ranges::any_of(inputs, filmed) ? "video" : "log";
}

}  // namespace

Verb localize_verb() {
  const std::vector<Verb> verbs = {localize_log_verb(), localize_robot_verb(), localize_camera_verb(),
                                   localize_video_verb()};
  return {
      .name = "localize",
      .sentence =
          "Estimate the pose of a robot or a camera in a tag map: from a recording, a video or live data",
      .help =
          R"(`waymark localize log` estimates a robot's trajectory from a recording of its drive: tag corners (or poses), or ranges
and bearings of landmarks, with odometry.
`waymark localize robot` listens to a robot that another program drives.
`waymark localize camera` estimates one pose per image of a live camera without a robot, hand-held or on a tripod.
`waymark localize video` does the same for each image in a video.

The subcommand may be omitted. With --robot KIND:ADDRESS it is `robot`, and with a camera address (v4l2:…, gstreamer:…)
it is `camera`. With a video, or with --camera and the recording of a camera without a robot, it is `video`; else `log`.
`waymark localize FILE --help` prints the flags of the selected subcommand. A file named log, robot, camera or video
must be given with its folder: ./log.

Exit code: 0 at least one pose estimated, 1 none, or an input was unusable, 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark localize lap.mcap --map map/map.yaml -o estimate.mcap
  waymark localize --robot ros2:limo --map map --publish-ros2
  waymark localize v4l2:/dev/video0 --camera calibration.yaml --map map --view
  waymark localize walk.mp4 --camera calibration.yaml --map map -o walk.tum
)",
      .verbs = verbs,
      .usual_verb = [verbs](const std::vector<std::string>& words) {
        return implied_subcommand(words, verbs);
      }};
}

}  // namespace waymark::cli

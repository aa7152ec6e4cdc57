#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "waymark/app/cli/verb.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/live/cameras.hpp"

namespace waymark::cli {
namespace {

/// Whether a word is the file name of a recorded drive. The file need not exist.
bool is_drive(const std::string& word) {
  const std::string suffix = std::filesystem::path(word).extension().string();
  std::error_code ignored;
  return is_recording(kind_of(word)) || suffix == ".mcap" || suffix == ".bag" || suffix == ".db3" ||
         suffix == ".csv" || std::filesystem::exists(std::filesystem::path(word) / "metadata.yaml", ignored);
}

/// The verb implied by a command line: "guided" for a live camera, "robot" for a recorded drive, otherwise
/// "camera". A recording combined with a board description implies "camera".
std::string implied_verb(const std::vector<std::string>& words, const std::vector<Verb>& verbs) {
  if (words.empty()) return {};
  const std::vector<std::string> inputs = inputs_of(words, verbs);
  if (has_word(words, "--guided") || has_word(words, "--resume") ||
      std::ranges::any_of(inputs, is_camera_address))
    return "guided";
  const bool has_board =
      has_word(words, "--cols") || has_word(words, "--rows") || has_word(words, "--target");
  return !has_board && std::ranges::any_of(inputs, is_drive) ? "robot" : "camera";
}

}  // namespace

Verb calibrate_verb() {
  const std::vector<Verb> verbs = {calibrate_camera_verb(), calibrate_guided_verb(), calibrate_robot_verb()};
  return {
      .name = "calibrate",
      .sentence = "Calibrate a robot or its camera",
      .help =
          R"(`camera` uses existing images, videos or detections. `guided` takes views of a board that you hold in front of a live
camera. `robot` uses the recording of a drive past tags.

The subcommand may be omitted. With a camera address (v4l2:…, gstreamer:…), --guided or --resume, it is `guided`. With a
recording, and without --cols, --rows and --target, it is `robot`; else `camera`. A file or folder named camera, guided
or robot must be given with its path: ./robot. `waymark calibrate camera v4l2:/dev/video0` runs
`waymark calibrate guided v4l2:/dev/video0`.

Examples:
  waymark calibrate 'board/*.png' --cols 6 --rows 5 --tag-size-m 0.025 -o calibration.yaml
  waymark calibrate v4l2:/dev/video0 --cols 6 --rows 5 --tag-size-m 0.025 --view -o calibration.yaml
  waymark calibrate lap.mcap --map map/map.yaml -o calibration.yaml
)",
      .verbs = verbs,
      .usual_verb = [verbs](const std::vector<std::string>& words) { return implied_verb(words, verbs); }};
}

}  // namespace waymark::cli

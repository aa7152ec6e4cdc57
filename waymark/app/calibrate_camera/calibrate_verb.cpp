#include "waymark/app/cli/verb.hpp"

namespace waymark::cli {

Verb calibrate_verb() {
  return {
      .name = "calibrate",
      .sentence = "Calibrate a robot or its camera",
      .help =
          R"(`camera` takes pictures, videos or detections that are there; `guided` takes the views of a board that you hold before
a live camera. `waymark calibrate camera v4l2:/dev/video0` is read as `waymark calibrate guided v4l2:/dev/video0`.

Examples:
  waymark calibrate camera 'board/*.png' --cols 6 --rows 5 --tag-size-m 0.025 -o calibration.yaml
  waymark calibrate guided v4l2:/dev/video0 --cols 6 --rows 5 --tag-size-m 0.025 --view -o calibration.yaml
  waymark calibrate robot lap.mcap --map map/map.yaml -o calibration.yaml
)",
      .verbs = {calibrate_camera_verb(), calibrate_guided_verb(), calibrate_robot_verb()}};
}

}  // namespace waymark::cli

#include "waymark/app/cli/verb.hpp"

namespace waymark::cli {

Verb calibrate_verb() {
  return {.name = "calibrate",
          .sentence = "Calibrate a robot or its camera",
          .help = R"(Examples:
  waymark calibrate camera 'board/*.png' --cols 6 --rows 5 --tag-size-m 0.025 -o calibration.yaml
  waymark calibrate robot lap.mcap --map map/map.yaml -o calibration.yaml
)",
          .verbs = {calibrate_camera_verb(), calibrate_robot_verb()}};
}

}  // namespace waymark::cli

#pragma once

#include "waymark/recording/camera_choice.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// --base-frame, --camera-frame, --camera-topic, --odometry-topic and --imu-topic, for verbs that read
/// recordings of any robot. `choice` must stay where it is while the command line is parsed.
void add_frame_flags(CLI::App& app, CameraChoice& choice);

}  // namespace waymark::cli

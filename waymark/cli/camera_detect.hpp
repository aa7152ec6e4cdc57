#pragma once

#include <string>
#include <vector>

#include "waymark/cli/console.hpp"
#include "waymark/live/detect_cameras.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// Whether the inputs of `waymark detect` are live cameras; fails on flags that do not go with what it is.
[[nodiscard]] Result<bool> is_camera_input(const CLI::App& app, const std::vector<std::string>& sources);

/// `waymark detect v4l2:…`, until Ctrl-C. The code of a camera that fails is the exit code.
[[nodiscard]] ExitCode detect_live(DetectCamerasJob job, bool json, bool covariance, const TagFinder& finder,
                                   Console& console);

}  // namespace waymark::cli

#pragma once

#include "waymark/cli/console.hpp"
#include "waymark/live/detect_cameras.hpp"

namespace waymark::cli {

/// `waymark detect v4l2:…`, until Ctrl-C. The code of a camera that fails is the exit code.
[[nodiscard]] ExitCode detect_live(DetectCamerasJob job, bool json, bool covariance, const TagFinder& finder,
                                   Console& console);

}  // namespace waymark::cli

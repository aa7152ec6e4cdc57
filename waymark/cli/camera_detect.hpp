#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/cli/console.hpp"
#include "waymark/cli/page_flags.hpp"
#include "waymark/jobs/poses.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// `waymark detect v4l2:…`: what is found in the pictures of a live camera, until Ctrl-C.
struct CameraDetectJob {
  std::string address{};
  std::optional<PoseSetup> poses{};
  double duration_s = 0;  ///< 0: until Ctrl-C
  bool json = false;
  bool covariance = false;
  bool view = false;
  PageOptions page{};
};

/// Whether the input of `waymark detect` is a live camera; fails on flags that do not go with what it is.
[[nodiscard]] Result<bool> is_camera_input(const CLI::App& app, const std::vector<std::string>& sources);

[[nodiscard]] ExitCode detect_camera(const CameraDetectJob& job, const TagFinder& finder, Console& console);

}  // namespace waymark::cli

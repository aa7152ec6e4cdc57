#pragma once

#include <string>

#include "waymark/cli/console.hpp"
#include "waymark/cli/page_flags.hpp"
#include "waymark/jobs/guided_calibration.hpp"

namespace waymark::cli {

/// `waymark calibrate camera v4l2:…`: calibration while somebody holds the board before the camera.
struct GuidedRun {
  const CalibrateCameraJob& job;
  const CalibrationTarget& target;
  const TagFinder& finder;
  const GuideOptions& options;
  std::string folder{};  ///< of the views; empty: they are not kept
  bool view = false;
  PageOptions page{};
};

/// Whether the sources are live cameras; fails where one is not alone.
[[nodiscard]] Result<bool> is_live_source(const std::vector<std::string>& sources);

/// Takes views until they tell the camera well enough, the source ends, or Ctrl-C; then the calibration by
/// all of them. Status lines go to the console.
[[nodiscard]] Result<CalibrateCameraReport> calibrate_guided(const GuidedRun& run, Console& console);

}  // namespace waymark::cli

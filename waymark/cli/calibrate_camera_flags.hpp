#pragma once

#include <CLI/App.hpp>

#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/live/calibrate_guided.hpp"

namespace waymark::cli {

/// The flags of `waymark calibrate camera`. Must stay where it is while the command line is parsed.
struct CalibrateCameraArgs : CalibrateCameraWords {
  explicit CalibrateCameraArgs(CLI::App& verb);

  Settings settings;
  bool json = false;
  OptionFlags<CameraCalibrationOptions> fitting;
  OptionFlags<VideoViewOptions> views;
  OptionFlags<GuideOptions> guide;
  DetectorFlags detector;

  /// What is missing, flags without an effect, and names that promise something else. `live`: the source is a
  /// live camera.
  [[nodiscard]] Status check(bool live) const;
};

}  // namespace waymark::cli

#pragma once

#include <string>

#include <CLI/App.hpp>

#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/page_flags.hpp"
#include "waymark/jobs/calibrate_camera.hpp"
#include "waymark/jobs/guided_calibration.hpp"

namespace waymark::cli {

/// The flags of `waymark calibrate camera`. Must stay where it is while the command line is parsed.
struct CalibrateCameraArgs {
  explicit CalibrateCameraArgs(CLI::App& verb);

  Settings settings;
  CalibrateCameraJob job{};
  bool json = false;
  bool guided = false;
  std::string folder{};
  bool view = false;
  PageOptions page{};
  OptionFlags<CameraCalibrationOptions> fitting;
  OptionFlags<VideoViewOptions> views;
  OptionFlags<GuideOptions> guide;
  DetectorFlags detector;

  /// What is missing, flags without an effect, and names that promise something else. `live`: the source is a
  /// live camera.
  [[nodiscard]] Status check(bool live) const;
};

}  // namespace waymark::cli

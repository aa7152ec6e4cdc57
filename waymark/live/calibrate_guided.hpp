#pragma once

#include <string>

#include "waymark/jobs/guided_calibration.hpp"
#include "waymark/live/live_page.hpp"

namespace waymark {

/// `waymark calibrate camera v4l2:…`: calibration while somebody holds the board before the camera.
struct GuidedRun {
  const CalibrateCameraJob& job;
  const CalibrationTarget& target;
  const TagFinder& finder;
  const GuideOptions& options;
  std::string folder{};  ///< of the views; empty: they are not kept
  bool view = false;     ///< a live camera is shown in the browser
  PageOptions page{};
};

/// Fails on pictures of their own among the sources: a guided calibration chooses among pictures that follow
/// each other.
[[nodiscard]] Status check_guided_sources(const CalibrateCameraJob& job);

/// Takes views until they tell the camera well enough, the source ends, or control cancels; then the
/// calibration by all of them. How far it is are progress and notes.
[[nodiscard]] Result<CalibrateCameraReport> calibrate_guided(const GuidedRun& run, const JobControl& control);

}  // namespace waymark

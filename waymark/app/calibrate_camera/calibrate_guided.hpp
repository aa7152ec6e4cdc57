#pragma once

#include <string>

#include "waymark/app/calibrate_camera/guided_calibration.hpp"
#include "waymark/app/common/flag_refusals.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/base/fields.hpp"

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

/// What a user says of a camera's calibration, but options.
struct CalibrateCameraWords {
  bool guided = false;   ///< of a live camera always
  std::string folder{};  ///< GuidedRun::folder
  bool view = false;
  PageOptions page{};
  CalibrateCameraJob job{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.guided, JobField("guided",
                                "Take the pictures of a video or recording as those of a live camera, until "
                                "enough views are there; of a live camera they are always taken so")
                           .less());
    visit(self.folder, JobField("resume FOLDER",
                                "Folder in which a guided calibration keeps its views as pictures, and goes "
                                "on from those there"));
    visit(self.view, JobField("view", "Show a live camera in the browser, with what is missing"));
    PageOptions::fields_of_view(self.page, visit);
    CalibrateCameraJob::fields(self.job, visit);
  }
};
/// Fails unless what is calibrated on is named, one way or the other.
[[nodiscard]] Status check_sources(const CalibrateCameraWords& words);

/// Fails on pictures of their own among the sources: a guided calibration chooses among pictures that follow
/// each other.
[[nodiscard]] Status check_guided_sources(const CalibrateCameraJob& job);

/// Fails on flags that have no effect, and where the two above do; `live`: the source is a live camera.
[[nodiscard]] Status check_effects(const CalibrateCameraWords& words, bool live, const GivenFlags& given);
/// What to do about options of a guided calibration.
inline constexpr const char* kGuided = "Add --guided, or give a live camera.";

/// Takes views until they tell the camera well enough, the source ends, or control cancels; then the
/// calibration by all of them. How far it is are progress and notes.
[[nodiscard]] Result<CalibrateCameraReport> calibrate_guided(const GuidedRun& run, const JobControl& control);

}  // namespace waymark

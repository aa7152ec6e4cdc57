#pragma once

#include <string>
#include <vector>

#include "waymark/app/calibrate_camera/guided_calibration.hpp"
#include "waymark/app/common/field_refusals.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/base/fields.hpp"

namespace waymark {

/// `waymark calibrate guided`: calibrates a camera while a person holds the board in front of it.
struct CalibrateGuidedJob {
  std::vector<std::string> sources{};  ///< a live camera, or videos and recordings
  bool recursive = false;
  std::string folder{};  ///< where views are stored; if empty, they are not stored
  bool view = false;     ///< whether to show the live camera in the browser
  PageOptions page{};
  TargetOptions target{};  ///< must be a board
  CameraFitJob fit{};
  GuideOptions guide{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(
        self.sources,
        JobField(
            "sources SOURCE",
            "Live camera, such as v4l2:/dev/video0; or videos and recordings, which are treated like a live "
            "camera")
            .input());
    visit(
        self.folder,
        JobField(
            "resume FOLDER",
            "Folder in which the views are stored as images; an earlier calibration is continued from them"));
    visit(self.view, JobField("view", "Show a live camera in the browser, with the missing views"));
    PageOptions::fields_of_view(self.page, visit);
    visit(self.recursive,
          JobField("recursive", "Search folders for videos and recordings recursively").less());
    TargetOptions::fields_of_board(self.target, visit);
    CameraFitJob::fields(self.fit, visit);
  }
};

/// Fails if there is no source, if a live camera is combined with other sources, or if a source is a single
/// image, because views are selected from image sequences. Also fails on given fields that have no effect.
[[nodiscard]] Status check_job(const CalibrateGuidedJob& job, const GivenFields& given);

/// Captures views until the calibration is accurate enough, the source ends, or the job is cancelled. Then
/// calibrates with all views. The state is reported as progress and notes.
[[nodiscard]] Result<CalibrateCameraReport> calibrate_guided(const CalibrateGuidedJob& job,
                                                             const CalibrationTarget& target,
                                                             const TagFinder& finder,
                                                             const JobControl& control);

}  // namespace waymark

#pragma once

#include <string>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/doctor/tag_checks.hpp"
#include "waymark/base/fields.hpp"

namespace waymark {

/// What `waymark doctor` looks at.
struct DoctorJob {
  std::string robot{};                 ///< KIND:ADDRESS, which is heard and not moved; empty: none
  std::string calibration{};           ///< empty: calibration.yaml in the current folder, if there is one
  std::vector<std::string> sources{};  ///< addresses of cameras to take pictures from
  std::string map{};                   ///< whose tags each source is searched for; empty: none
  std::string folder = ".";            ///< where recordings will be written
  LoopTrial trial{};
  TagSizeTrial tag{};  ///< by the pictures of each source; without a distance: none

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.robot, JobField("robot NAME",
                               "Robot to listen to, without moving it: limo:PORT, mbot:ADDRESS, ros2:PROFILE "
                               "or gazebo:PROFILE, for example limo:/dev/ttyTHS1"));
    visit(
        self.calibration,
        JobField(
            "camera FILE",
            "Calibration to look at. Unless given: calibration.yaml in the current folder, if there is one"));
    visit(self.sources,
          JobField("camera_source ADDRESS",
                   "Camera to open and to take pictures from for a second, for example v4l2:/dev/video0"));
    visit(self.tag.distance_m,
          JobField("tag_at_m FLOAT",
                   "Measure the printed size of a tag that hangs at this distance, from the front of the "
                   "lens to its centre, measured with a tape to a centimetre",
                   0.2, 20.0)
              .needs("camera_source,tag_size_m"));
    visit(self.tag.size_m,
          JobField("tag_size_m FLOAT", "Side that the black square of that tag should have", 0.001, 10.0)
              .needs("tag_at_m"));
    visit(self.tag.families,
          JobField("family NAME", "Families that the tag may be of").by_commas().needs("tag_at_m"));
    visit(self.map, JobField("map FILE",
                             "Map whose tags should be in view of these cameras, map.yaml or its folder: "
                             "which of them are missed where the camera stands, and why")
                        .needs("camera_source"));
    visit(self.folder, JobField("folder PATH", "Folder in which recordings will be written"));
    visit(self.trial.width, JobField("width_px INTEGER", "Width of the pictures of the trial", 64, 8192));
    visit(self.trial.height, JobField("height_px INTEGER", "Height of the pictures of the trial", 64, 8192));
    visit(self.trial.rate_hz, JobField("rate_hz FLOAT", "Rate of the pictures of the trial", 0.1, 1000.0));
  }
};

struct DoctorReport {
  std::vector<DoctorLine> checks{};  ///< in the order in which they are read
};

/// All checks of a computer. Takes two seconds for the loop and one for each camera. Fails where there is no
/// such robot, nothing can be detected, or it was cancelled.
[[nodiscard]] Result<DoctorReport> run_doctor(
    const DoctorJob& job, const DoctorCancelled& cancelled = [] { return false; });

/// Whether one of the checks failed.
[[nodiscard]] bool any_failed(const DoctorReport& report);
/// A line each, and below it the command that mends it.
[[nodiscard]] std::string to_text(const DoctorReport& report);
[[nodiscard]] ReportFields fields(const DoctorLine& line);
[[nodiscard]] ReportFields fields(const DoctorReport& report);

}  // namespace waymark

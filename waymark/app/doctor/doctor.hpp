#pragma once

#include <string>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/doctor/tag_checks.hpp"
#include "waymark/base/fields.hpp"

namespace waymark {

/// Inputs for `waymark doctor`.
struct DoctorJob {
  std::string robot{};        ///< KIND:ADDRESS of a robot to listen to without moving it; empty if there is
                              ///< none
  std::string calibration{};  ///< if empty, calibration.yaml in the current folder is used if it exists
  std::vector<std::string> sources{};  ///< addresses of cameras to open
  std::string map{};                   ///< map whose tags the sources should see; empty if there is none
  std::string folder = ".";            ///< folder for recordings
  LoopTrial trial{};
  TagSizeTrial tag{};  ///< measured with each source if its distance is set

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.robot, JobField("robot NAME",
                               "Robot to listen to, without moving it: limo:PORT, mbot:ADDRESS, ros2:PROFILE "
                               "or gazebo:PROFILE, for example limo:/dev/ttyTHS1"));
    visit(self.calibration,
          JobField("camera FILE",
                   "Calibration to check. Default: calibration.yaml in the current folder, if it exists"));
    visit(self.sources,
          JobField("camera_source ADDRESS", "Camera to open for one second, for example v4l2:/dev/video0"));
    visit(self.tag.distance_m,
          JobField("tag_at_m FLOAT",
                   "Measure the printed size of a tag at this distance from the front of the lens to its "
                   "centre, measured with a tape to a centimetre",
                   0.2, 20.0)
              .needs("camera_source,tag_size_m"));
    visit(self.tag.size_m,
          JobField("tag_size_m FLOAT", "Nominal side of the black square of that tag", 0.001, 10.0)
              .needs("tag_at_m"));
    visit(self.tag.families,
          JobField("family NAME", "Possible families of the tag").comma_separated().needs("tag_at_m"));
    visit(self.map, JobField("map FILE",
                             "Map whose tags should be in view of these cameras, map.yaml or its folder: "
                             "reports tags that are missed, and why")
                        .needs("camera_source"));
    visit(self.folder, JobField("folder PATH", "Folder for recordings"));
    visit(self.trial.width, JobField("width_px INTEGER", "Width of the images of the loop trial", 64, 8192));
    visit(self.trial.height,
          JobField("height_px INTEGER", "Height of the images of the loop trial", 64, 8192));
    visit(self.trial.rate_hz, JobField("rate_hz FLOAT", "Frame rate of the loop trial", 0.1, 1000.0));
  }
};

struct DoctorReport {
  std::vector<DoctorLine> checks{};  ///< in the order in which they are printed
};

/// Runs all checks. Takes two seconds for the loop and one for each camera. Fails if the robot is unknown, if
/// the detector cannot be created, or if cancelled.
[[nodiscard]] Result<DoctorReport> run_doctor(
    const DoctorJob& job, const DoctorCancelled& cancelled = [] { return false; });

/// Whether any of the checks failed.
[[nodiscard]] bool any_failed(const DoctorReport& report);
/// One line per check, followed by the command that fixes the problem.
[[nodiscard]] std::string to_text(const DoctorReport& report);
[[nodiscard]] ReportFields fields(const DoctorLine& line);
[[nodiscard]] ReportFields fields(const DoctorReport& report);

}  // namespace waymark

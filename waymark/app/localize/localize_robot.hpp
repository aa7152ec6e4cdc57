#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/localize/localize_fields.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/localization/method.hpp"
#include "waymark/runtime/localize_session.hpp"

namespace waymark {

class LiveFeed;

/// `waymark localize robot`: localises a robot that is driven by another program.
struct LocalizeRobotJob {
  std::string robot{};  ///< given as KIND:ADDRESS
  std::string map{};
  /// Robot description. If empty, robot.yaml next to the map or, if there is none, the default for the robot
  /// kind.
  std::string robot_file{};
  std::string calibration{};  ///< path of a calibration.yaml; empty if there is none
  std::string output{};       ///< recording of every sample, or TUM file to write; if empty, none is written
  std::optional<double> tag_size_m{};
  std::vector<double> start{};                ///< x, y [m] and yaw [deg]; empty if unknown
  std::vector<std::string> camera_sources{};  ///< cameras on this computer, given as [NAME=]ADDRESS
  ImageSettings image_settings{};
  double duration_s = 0;  ///< 0 means until stopped
  double every_s = 1;     ///< time between calls to `on_report`
  std::string images{};   ///< "raw" or "jpeg"; if empty, images are not recorded
  LocalizationKind method = LocalizationKind::Riekf;
  RiekfOptions filter{};
  std::function<Status(RiekfOptions&)> asked{};  ///< see LocalizeJob::asked
  AnchorOptions anchor{};
  LiveFeed* feed = nullptr;  ///< null if there are no viewers
  /// See LocalizeListener::on_report.
  std::function<void(SensorTime, const std::optional<LocalizationEstimate>&)> on_report =
      [](SensorTime, const std::optional<LocalizationEstimate>&) {};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.robot,
          JobField("robot KIND:ADDRESS",
                   "Robot to localise while another program drives it, named as for `waymark teach` "
                   "(ros2:limo, mbot:)")
              .required());
    visit(self.map, localize_fields::map());
    visit(self.robot_file,
          JobField("robot_file NAME",
                   "Robot file: a name listed by `waymark robots`, or the path of a .yaml "
                   "file. Default: robot.yaml next to the map, or the file for the robot kind"));
    visit(self.calibration, localize_fields::calibration());
    visit(self.output, JobField("output FILE",
                                "Recording of every sample and the estimates to write (.mcap), or text file "
                                "with the certain estimates, one pose per line (.txt, .tum: TUM)"));
    visit(self.tag_size_m, localize_fields::tag_size_m());
    visit(self.start, localize_fields::start());
    visit(self.duration_s, localize_fields::duration_s());
    visit(self.every_s, localize_fields::every_s());
    visit(self.images, localize_fields::record_images());
    visit(self.camera_sources,
          JobField("camera_source ADDRESS",
                   "Camera on this computer that provides images for a robot that sends none: "
                   "v4l2:/dev/video0, or NAME=ADDRESS if the robot file has several cameras")
              .less());
    ImageSettings::fields(self.image_settings, visit);
  }
};

struct LocalizeRobotReport {
  LocalizeReport localized{};
  LocalizeEnd end{};
};

/// Loads the job's robot together with the cameras on this computer (add_live_cameras()). No commands are
/// sent to the robot. Fails if the robot is unknown or the job is invalid.
[[nodiscard]] Result<RobotSetup> load_listening_robot(const LocalizeRobotJob& job);

/// Localises the robot in the setup until stopped or cancelled. Nothing is sent to the robot. Fails for the
/// same reasons as localize(), if the robot waits for commands (lockstep), and if the robot process ends. The
/// recording up to that point is kept.
[[nodiscard]] Result<LocalizeRobotReport> localize_robot(const RobotSetup& setup, const LocalizeRobotJob& job,
                                                         const JobControl& control);

}  // namespace waymark

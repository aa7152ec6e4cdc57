#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/localize/localize_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/pipeline/localizer.hpp"
#include "waymark/recording/recording_setup.hpp"
#include "waymark/samples/calibration.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// `waymark localize log`: poses of a robot from a recording of its drive and a tag map.
struct LocalizeJob {
  std::vector<std::string> logs{};
  std::string map{};
  std::string robot{};        ///< file or name; empty: what the recording or the map's folder has
  std::string calibration{};  ///< calibration.yaml; empty: none
  std::string output{};       ///< recording or TUM file to write; empty: none
  std::optional<double> tag_size_m{};
  CameraChoice frames{};              ///< of a recording that holds several cameras
  std::vector<double> sensor_pose{};  ///< x, y [m], yaw [deg] of a sensor in the plane; empty: none
  std::vector<double> start{};        ///< x, y [m], yaw [deg]; empty: found out
  LocalizationKind method = LocalizationKind::Riekf;
  double map_sigma_m = 0.01;  ///< of tags of a map without covariances; for a calibration by lap
  /// Else the noise of motion and observations is found from the recording, where the assumed does not fit.
  bool no_adapt = false;
  RiekfOptions filter{};
  /// Writes the options of the filter that the caller chose over those of the robot's file and of the
  /// calibration, which go before `filter`.
  std::function<Status(RiekfOptions&)> asked{};
  AnchorOptions anchor{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.logs,
          JobField("logs LOG", "Recordings of one drive: MCAP, rosbag2, ROS 1, LCM, CSV tables").input());
    visit(self.map, localize_fields::map());
    visit(self.robot, JobField("robot NAME",
                               "Camera of the robot and its mounting: a robot file, or a name. Unless given: "
                               "from the recording, or from robot.yaml beside the map"));
    CameraChoice::fields(self.frames, visit);
    visit(self.calibration, localize_fields::calibration());
    visit(self.output, JobField("output FILE",
                                "Record the estimates (.mcap), or write the certain ones as poses, one per "
                                "line (.txt, .tum: TUM)"));
    visit(self.tag_size_m, localize_fields::tag_size_m());
    visit(self.sensor_pose,
          JobField("sensor_pose NUMBER", "Mounting of the range sensor on the robot: x y [m], yaw [deg]")
              .parts(3));
    visit(self.start, localize_fields::start());
    visit(self.no_adapt, JobField("no_adapt",
                                  "Keep the assumed noise instead of estimating the noise of motion and "
                                  "observations from the recording"));
  }
};

/// Fails on a job that names no recording, or whose values contradict each other.
[[nodiscard]] Status check_job(const LocalizeJob& job);

/// Everything that was read.
struct LocalizeInputs {
  LocalizerSetup setup{};
  std::vector<Sample> samples{};  ///< in order of their stamps
  std::vector<std::string> warnings{};
  RecordingSetup recorded{};  ///< what the recording itself holds about the camera
  std::size_t observations = 0;
  bool mounting_guessed = false;  ///< it is not known where the sensor sits
  bool planar_sensor = false;     ///< `sensor_pose`: x ahead, y left; else the axes are a camera's
};

[[nodiscard]] Result<LocalizeInputs> read_localize_inputs(const LocalizeJob& job, const JobControl& control);

/// The same of a robot that is there, instead of a recording: there are no samples. `robot_yaml`: the text of
/// its file. Fails where its camera needs tags with poses and the map has points only.
[[nodiscard]] Result<LocalizeInputs> read_localize_inputs(const LocalizeJob& job,
                                                          const RobotDescription& robot,
                                                          const std::string& robot_yaml);

/// Lets the localizer start at `start`, if the job has one.
void start_localizer(const LocalizeJob& job, Localizer& localizer);

/// The calibration values used by the filters.
void take_calibrated(const Calibration& calibration, RiekfOptions& filter);

struct LocalizeReport {
  LocalizationKind method = LocalizationKind::Riekf;
  std::size_t estimates = 0;
  std::size_t certain = 0;
  std::optional<double> first_fix_s{};  ///< after the first sample
  std::size_t compared = 0;             ///< observations of mapped tags that were compared with an estimate
  std::size_t accepted = 0;
  double nis_mean = 0;  ///< of those accepted, over their degrees of freedom; 1 if all assumptions hold
  std::optional<double> lasting_nis{};  ///< Tracker::lasting_nis()
  double duration_s = 0;
  double wall_s = 0;
  std::optional<LocalizationEstimate> last{};
  std::vector<std::string> problems{};
};

/// Runs the samples through the method and writes the output: unchanged samples of motion and ground truth,
/// certain estimates on /waymark/pose, uncertain ones on /waymark/pose_uncertain, each compared observation
/// on /waymark/nis.
[[nodiscard]] Result<LocalizeReport> localize(const LocalizeJob& job, const LocalizeInputs& inputs,
                                              const JobControl& control);
/// The content of `--json`.
[[nodiscard]] ReportFields fields(const LocalizeReport& report);

/// The printed report: estimates, observations, last pose.
[[nodiscard]] std::string to_text(const LocalizeReport& report);
/// Warnings about the report, with remedies.
[[nodiscard]] std::vector<std::string> doubts_about(const LocalizeReport& report);

}  // namespace waymark

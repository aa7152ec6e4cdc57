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
#include "waymark/localization/sensor_diagnosis.hpp"
#include "waymark/pipeline/localizer.hpp"
#include "waymark/recording/recording_setup.hpp"
#include "waymark/samples/calibration.hpp"
#include "waymark/samples/clock_check.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// `waymark localize log`: estimates the poses of a robot from the recording of a drive and a tag map.
struct LocalizeJob {
  std::vector<std::string> logs{};
  std::string map{};
  std::string robot{};        ///< file or name; if empty, taken from the recording or the map folder
  std::string calibration{};  ///< path of a calibration.yaml; empty if there is none
  std::string output{};       ///< recording or TUM file to write; if empty, none is written
  std::optional<double> tag_size_m{};
  CameraChoice frames{};              ///< for recordings with several cameras
  std::vector<double> sensor_pose{};  ///< x, y [m] and yaw [deg] of a planar sensor; empty if not set
  std::vector<double> start{};        ///< x, y [m] and yaw [deg]; empty if unknown
  LocalizationKind method = LocalizationKind::Riekf;
  /// Standard deviation of tag positions if the map has no covariances. Only used for calibration from a lap.
  double map_sigma_m = 0.01;
  /// If false, and the recording is inconsistent with the assumed noise, motion and observation noise are
  /// estimated from the recording.
  bool no_adapt = false;
  RiekfOptions filter{};
  /// Applies the filter options that were explicitly set by the caller. They override the robot file and the
  /// calibration, both of which override `filter`.
  std::function<Status(RiekfOptions&)> asked{};
  AnchorOptions anchor{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.logs,
          JobField("logs LOG", "Recordings of one drive: MCAP, rosbag2, ROS 1, LCM, CSV tables").input());
    visit(self.map, localize_fields::map());
    visit(self.robot, JobField("robot NAME",
                               "The robot's camera and its mounting: a robot file, or a name. Default: from "
                               "the recording, or from robot.yaml next to the map"));
    CameraChoice::fields(self.frames, visit);
    visit(self.calibration, localize_fields::calibration());
    visit(self.output, JobField("output FILE",
                                "Recording of the estimates to write (.mcap), or text file with the certain "
                                "ones, one pose per line (.txt, .tum: TUM)"));
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

/// Fails if the job has no recording or contains contradictory values.
[[nodiscard]] Status check_job(const LocalizeJob& job);

/// All inputs that are read for a job.
struct LocalizeInputs {
  LocalizerSetup setup{};
  std::vector<Sample> samples{};  ///< in the order of their timestamps
  std::vector<std::string> warnings{};
  RecordingSetup recorded{};   ///< camera setup read from the recording
  std::string first_damage{};  ///< first damage found in the recordings; empty if they are intact
  /// Why samples were removed: they are stamped by another clock than the observations. Its error is one of
  /// the warnings as well.
  std::optional<OtherClock> other_clock{};
  /// Faults of sensors. The samples and the setup contain its correction; its findings are among the
  /// warnings.
  SensorDiagnosis sensors{};
  std::size_t observations = 0;
  bool mounting_guessed = false;  ///< whether the mounting was unknown and had to be assumed
  /// Whether `sensor_pose` was set. If so, the sensor has x forward and y left; otherwise it has optical
  /// axes.
  bool planar_sensor = false;
};

[[nodiscard]] Result<LocalizeInputs> read_localize_inputs(const LocalizeJob& job, const JobControl& control);

/// Reads the inputs for a connected robot instead of a recording, so there are no samples. `robot_yaml` is
/// the content of the robot file. Fails if the map contains only points, because the camera needs tag poses.
[[nodiscard]] Result<LocalizeInputs> read_localize_inputs(const LocalizeJob& job,
                                                          const RobotDescription& robot,
                                                          const std::string& robot_yaml);

/// Starts the localizer at the pose `start`, if set.
void start_localizer(const LocalizeJob& job, Localizer& localizer);

/// Copies the calibrated values into the filter options.
void take_calibrated(const Calibration& calibration, RiekfOptions& filter);

struct LocalizeReport {
  LocalizationKind method = LocalizationKind::Riekf;
  std::size_t estimates = 0;
  std::size_t certain = 0;
  std::optional<double> first_fix_s{};  ///< time after the first sample
  std::size_t compared = 0;  ///< number of map tag observations that were compared with an estimate
  std::size_t accepted = 0;
  double nis_mean = 0;  ///< NIS of accepted observations per degree of freedom; 1 if all assumptions hold
  std::optional<double> lasting_nis{};  ///< see Tracker::lasting_nis()
  double duration_s = 0;
  double wall_s = 0;
  std::optional<LocalizationEstimate> last{};
  std::vector<std::string> problems{};
  std::vector<SensorFinding> sensors{};  ///< faults of sensors
};

/// Localises the samples and writes the output. Odometry and ground truth are copied unchanged. Certain
/// estimates are written to /waymark/pose, uncertain ones to /waymark/pose_uncertain, and each compared
/// observation to /waymark/nis.
[[nodiscard]] Result<LocalizeReport> localize(const LocalizeJob& job, const LocalizeInputs& inputs,
                                              const JobControl& control);
/// Fields of the `--json` object.
[[nodiscard]] ReportFields fields(const LocalizeReport& report);

/// The printed report: estimates, observations, and the last pose.
[[nodiscard]] std::string to_text(const LocalizeReport& report);
/// Warnings about the results, with suggested remedies.
[[nodiscard]] std::vector<std::string> localization_warnings(const LocalizeReport& report);

}  // namespace waymark

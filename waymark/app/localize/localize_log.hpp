#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/app/common/job_control.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/pipeline/localizer.hpp"
#include "waymark/recording/recording_setup.hpp"
#include "waymark/samples/calibration.hpp"
#include "waymark/samples/robot_samples.hpp"

/// `waymark localize`: what it reads, and what it writes.
namespace waymark {

/// Where things come from, as the command line says.
struct LocalizeJob {
  std::vector<std::string> logs{};
  std::string map{};
  std::string robot{};        ///< file or name; empty: what the recording or the map's folder says
  std::string calibration{};  ///< calibration.yaml; empty: none
  std::string output{};       ///< recording or TUM file to write; empty: none
  std::optional<double> tag_size_m{};
  CameraChoice frames{};              ///< of a recording that holds several cameras
  std::vector<double> sensor_pose{};  ///< x, y [m], yaw [deg] of a sensor in the plane; empty: none
  std::vector<double> start{};        ///< x, y [m], yaw [deg]; empty: found out
  LocalizationKind method = LocalizationKind::Riekf;
  double map_sigma_m = 0.01;  ///< of tags of a map that says of none how well it knows it; calibration by lap
  bool adapt =
      true;  ///< noise of motion and observations from the recording, where what is assumed does not fit
  RiekfOptions filter{};
  AnchorOptions anchor{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.logs, JobField("logs LOG",
                              "Recordings of one drive: MCAP, rosbag2, ROS 1, LCM, CSV tables; or a video; "
                              "or a live camera: v4l2:/dev/video0. None with --robot KIND:ADDRESS")
                         .input());
    visit(self.map, JobField("map FILE",
                             "Map of the tags: map.yaml or its folder, apriltags_poses.yaml of the Robotics "
                             "Academy, CSV with id, x, y, or a field layout of WPILib or Limelight")
                        .required());
    visit(self.robot,
          JobField("robot NAME",
                   "Robot to localise while somebody else drives it, KIND:ADDRESS as `waymark teach` has it "
                   "(ros2:limo, mbot:); or of a recording its camera and mounting: a robot's file, or a "
                   "name. Unless given: the recording's, or those of robot.yaml beside the map"));
    CameraChoice::fields(self.frames, visit);
    visit(self.calibration, JobField("calibration FILE", "Calibration of this robot (calibration.yaml)"));
    visit(self.output, JobField("output FILE",
                                "Record the estimates (.mcap), or write the certain ones as poses, one a "
                                "line (.txt, .tum: TUM)"));
    visit(self.tag_size_m,
          JobField("tag_size_m NUMBER", "Tag size where the map has none (0.24 for the Academy's)"));
    visit(self.sensor_pose,
          JobField("sensor_pose NUMBER", "Mounting of the range sensor on the robot: x y [m], yaw [deg]")
              .parts(3));
    visit(self.start,
          JobField("start NUMBER", "Initial pose of the robot, if it is known: x y [m], yaw [deg]").parts(3));
  }
};

/// Everything that was read.
struct LocalizeInputs {
  LocalizerSetup setup{};
  std::vector<Sample> samples{};  ///< in order of their stamps
  std::vector<std::string> warnings{};
  RecordingSetup recorded{};  ///< what the recording itself says of the camera
  std::size_t observations = 0;
  bool mounting_guessed = false;  ///< nobody says where the sensor sits
  bool planar_sensor = false;     ///< --sensor-pose: x ahead, y left; else the axes are a camera's
};

[[nodiscard]] Result<LocalizeInputs> read_localize_inputs(const LocalizeJob& job, const JobControl& control);

/// The same of a robot that is there, instead of a recording: there are no samples. `robot_yaml`: the text of
/// its file. Fails where its camera needs tags with poses and the map has points only.
[[nodiscard]] Result<LocalizeInputs> read_localize_inputs(const LocalizeJob& job,
                                                          const RobotDescription& robot,
                                                          const std::string& robot_yaml);

/// Lets the localizer start where the job says, if it does.
void start_localizer(const LocalizeJob& job, Localizer& localizer);

/// The numbers of a calibration that the filters are told.
void take_calibrated(const Calibration& calibration, RiekfOptions& filter);

struct LocalizeReport {
  std::size_t estimates = 0;
  std::size_t certain = 0;
  std::optional<double> first_fix_s{};  ///< after the first sample
  std::size_t compared = 0;             ///< observations of mapped tags that were compared with an estimate
  std::size_t accepted = 0;
  double nis_mean = 0;  ///< of those accepted, over their degrees of freedom; 1 when all is as assumed
  std::optional<double> lasting_nis{};  ///< Tracker::lasting_nis()
  double duration_s = 0;
  double wall_s = 0;
  std::optional<LocalizationEstimate> last{};
  std::vector<std::string> problems{};
};

/// Runs the samples through the method and writes the output: the samples of motion and truth as they were,
/// certain estimates on /waymark/pose, guesses on /waymark/pose_uncertain, each compared observation on
/// /waymark/nis.
[[nodiscard]] Result<LocalizeReport> localize(const LocalizeJob& job, const LocalizeInputs& inputs,
                                              const JobControl& control);
[[nodiscard]] nlohmann::ordered_json to_json(const LocalizeJob& job, const LocalizeReport& report);

/// What `waymark localize` prints: estimates, observations, where the robot was last.
[[nodiscard]] std::string to_text(const LocalizeReport& report);
/// What the report gives reason to doubt, and what to do about it.
[[nodiscard]] std::vector<std::string> doubts_about(const LocalizeReport& report);

}  // namespace waymark

#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/flag_refusals.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/localize/camera_moment.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/app/localize/localize_video.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/localization/method.hpp"
#include "waymark/runtime/localize_session.hpp"

/// `waymark localize` of a robot or a camera that is there, instead of a recording.
namespace waymark {

/// What is localised: the recordings of a job, a video, a camera that is there, or a robot that is there.
enum class LocalizeInput { Recording, Video, Camera, Robot };

/// What a user says of a robot, a camera or a video that is localised, instead of a recording.
struct LocalizeLive {
  std::string robot_file{};
  std::vector<std::string> camera_sources{};
  CameraDescription camera{};  ///< without a robot
  PictureSettings pictures{};
  std::string images{};   ///< how pictures are recorded: raw, jpeg; empty: not at all
  double duration_s = 0;  ///< 0: until somebody ends it
  double every_s = 1;     ///< between the lines about where it is

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.robot_file,
          JobField(
              "robot_file NAME",
              "With --robot KIND:ADDRESS: body and camera of the robot: a name that `waymark robots` lists, "
              "or the path of a .yaml file. Unless given: robot.yaml beside the map, or as the kind says"));
    visit(self.camera.file,
          JobField("camera FILE",
                   "Calibration of a camera without a robot: live, of a video or of its recording "
                   "(calibration.yaml, ROS camera_info, kalibr YAML or JSON of PhotonVision)"));
    CameraDescription::fields(self.camera, visit);
    visit(self.camera.readout_ms,
          JobField(
              "readout_ms NUMBER",
              "Time from the first row to the last of the rolling shutter of a video, in milliseconds; "
              "negative when rows are read from the bottom. Unless given: that of a calibration.yaml, else 0",
              -200.0, 200.0)
              .less());
    visit(self.duration_s,
          JobField("duration_s NUMBER",
                   "With a robot or a live camera: end after so many seconds. Unless given: at Ctrl-C", 0.01,
                   1e6));
    visit(
        self.every_s,
        JobField("every_s NUMBER",
                 "With a robot, a live camera or a video: time between the lines that are printed", 0.01, 1e6)
            .less());
    visit(self.images, JobField("record_images HOW",
                                "With -o and a robot or a live camera: also record the pictures: jpeg, or "
                                "raw, ten times as large")
                           .one_of("jpeg,raw")
                           .less());
    visit(self.camera_sources,
          JobField("camera_source ADDRESS",
                   "Camera of this computer that gives the pictures of a robot which sends none: "
                   "v4l2:/dev/video0, or NAME=ADDRESS where the robot's file names several")
              .less());
    PictureSettings::fields(self.pictures, visit);
  }
};

/// By the names of the job. `calibrated`: a camera's calibration is given, by which the recording of a camera
/// counts as a video. Fails on inputs that do not go together, and where there is none.
[[nodiscard]] Result<LocalizeInput> localize_kind(const LocalizeJob& job, bool calibrated);

/// The same, and fails on flags that do not go with it.
[[nodiscard]] Result<LocalizeInput> localize_input(const LocalizeJob& job, const GivenFlags& given);

/// One line about where a robot or a camera is or was, with its end. `since_s`: from the first line on.
[[nodiscard]] std::string estimate_line(double since_s, const std::optional<LocalizationEstimate>& estimate);
/// The keys of `--json` (docs/reference/cli.md).
[[nodiscard]] std::string estimate_json(SensorTime now, const std::optional<LocalizationEstimate>& estimate);

[[nodiscard]] std::string moment_line(double since_s, const CameraMoment& moment);
[[nodiscard]] std::string moment_json(const CameraMoment& moment);

/// The lines of moments that come one after the other, one every so often in their own time.
class MomentLines {
 public:
  MomentLines(double every_s, bool json, std::function<void(const std::string&)> print)
      : every_(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(every_s))),
        json_(json),
        print_(std::move(print)) {}

  void take(const CameraMoment& moment);

 private:
  Duration every_;
  bool json_;
  std::function<void(const std::string&)> print_;
  std::optional<SensorTime> first_{};
  SensorTime next_{};
};

class LiveFeed;

/// `waymark localize` of a camera without a robot, in a hand or on a stand.
struct LocalizeCameraJob {
  LocalizeJob localize{};  ///< map, output; else nothing of it
  CameraModel camera;
  std::string images{};   ///< how pictures are recorded: raw, jpeg; empty: not at all
  double duration_s = 0;  ///< 0: until the control cancels it
  LiveFeed* feed = nullptr;
  std::function<void(const CameraMoment&)> on_moment = [](const CameraMoment&) {};  ///< of every picture
};

struct LocalizeCameraReport {
  CameraWatchEnd end{};
  std::size_t known = 0;  ///< pictures with a pose
};

/// Localises an opened camera until it ends, the time is over, or the control cancels it. A recording holds
/// tags and poses (/waymark/pose) with stamps since 1970.
[[nodiscard]] Result<LocalizeCameraReport> localize_camera(LiveCamera& camera, const LocalizeCameraJob& job,
                                                           const JobControl& control);

/// `waymark localize` of a robot that somebody else drives.
struct LocalizeRobotJob {
  LocalizeJob localize{};  ///< of its output a recording holds every sample; `logs` and `adapt` mean nothing
  std::string images{};    ///< how pictures are recorded: raw, jpeg; empty: not at all
  LocalizeSessionOptions session{};
  LiveFeed* feed = nullptr;  ///< of viewers, if there are any
  /// LocalizeListener::on_report.
  std::function<void(SensorTime, const std::optional<LocalizationEstimate>&)> on_report =
      [](SensorTime, const std::optional<LocalizationEstimate>&) {};
};

struct LocalizeRobotReport {
  LocalizeReport localized{};
  LocalizeEnd end{};
};

/// Makes the robot of load_kind() one that is heard and never commanded.
void only_listen(RobotSetup& setup);

/// A robot KIND:ADDRESS that is only heard, with cameras of this computer (add_live_cameras()). Described by
/// `robot_file`; empty: robot.yaml beside the map, else as the kind says.
[[nodiscard]] Result<RobotSetup> load_listening_robot(const std::string& robot, const std::string& robot_file,
                                                      const std::filesystem::path& map,
                                                      const std::vector<std::string>& camera_sources);

/// Localises the robot of the setup until somebody ends it, or the control cancels it. Nothing is sent to the
/// robot. Fails where the robot waits for its commands (lockstep), as localize() does, and when the robot's
/// process ends; what was recorded by then is kept.
[[nodiscard]] Result<LocalizeRobotReport> localize_robot(const RobotSetup& setup, const LocalizeRobotJob& job,
                                                         const JobControl& control);

/// Lines about where it is.
struct LocalizeLines {
  bool json = false;
  std::function<void(const std::string&)> print;
};

[[nodiscard]] LocalizeRobotJob described_robot(const LocalizeLive& words, const LocalizeJob& job,
                                               const LocalizeLines& lines);
/// Both fail without a calibration, and where it cannot be read.
[[nodiscard]] Result<LocalizeCameraJob> described_live_camera(const LocalizeLive& words,
                                                              const LocalizeJob& job,
                                                              const LocalizeLines& lines);
[[nodiscard]] Result<LocalizeVideoJob> described_video(const LocalizeLive& words, const LocalizeJob& job,
                                                       const LocalizeLines& lines);

/// "812 pictures in 27.0 s, the place known in 640"
[[nodiscard]] std::string to_text(const LocalizeCameraReport& report);
[[nodiscard]] std::string to_text(const LocalizeVideoReport& report);

}  // namespace waymark

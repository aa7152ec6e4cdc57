#pragma once

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/flag_refusals.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/job_field.hpp"

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

}  // namespace waymark

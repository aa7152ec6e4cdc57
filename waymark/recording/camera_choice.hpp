#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/recording/camera_facts.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// What a caller says of the frames and topics of a recording; empty: found out.
struct CameraChoice {
  std::string base_frame{};
  std::string camera_frame{};
  std::string camera_topic{};    ///< of its pictures, tags or calibration, or the namespace above them
  std::string odometry_topic{};  ///< of several
  std::string imu_topic{};       ///< of several

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.base_frame, JobField("base_frame FRAME",
                                    "Frame of the robot's base. Unless given: child_frame_id of the "
                                    "odometry, else base_link or base_footprint")
                               .grouped("Recordings of other robots"));
    visit(self.camera_frame,
          JobField("camera_frame FRAME",
                   "Optical frame of the camera (x right, y down, z ahead); of several cameras the one with "
                   "this frame. Unless given: that of the header of its tags, pictures or calibration")
              .grouped("Recordings of other robots"));
    visit(self.camera_topic,
          JobField("camera_topic TOPIC",
                   "Topic, or namespace such as /camera/color, of the camera to use, of several")
              .grouped("Recordings of other robots"));
    visit(self.odometry_topic, JobField("odometry_topic TOPIC", "Topic of the odometry to use, of several")
                                   .grouped("Recordings of other robots"));
    visit(self.imu_topic, JobField("imu_topic TOPIC", "Topic of the IMU to use, of several")
                              .grouped("Recordings of other robots"));
  }
};

/// The one camera of a recording that is used, and where it sits.
struct ChosenCamera {
  std::optional<CameraModel> camera{};
  std::optional<SE3> base_T_cam{};
  std::optional<SO3> base_R_imu{};  ///< where the IMU's axes are not those of the base
  std::string base_frame{};
  std::string camera_frame{};
  std::set<std::string> unused{};         ///< topics that must not be read beside it: other cameras, copies
  std::vector<std::string> notes{};       ///< what was chosen among several, in words
  std::optional<Error> camera_error{};    ///< why there is no calibration
  std::optional<Error> mounting_error{};  ///< why there is no mounting: shows the tree
  std::optional<Error> ambiguous{};       ///< what must be said before the recording can be used at all
  std::vector<std::string> frames{};      ///< of the cameras, where there are several and none was named
};

/// Chooses. The base is --base-frame, else what the odometry moves (child_frame_id), else base_link or
/// base_footprint, below whatever namespace. The camera's frame is --camera-frame, else that of the header of
/// its tags or pictures, else that of its calibration. The mounting is composed of every link between them.
[[nodiscard]] ChosenCamera choose_camera(const CameraFacts& facts, const CameraChoice& choice);

/// All cameras of a recording: one for each frame of tags or pictures, in the order of their calibrations.
/// Empty unless there are several, none was named, and calibration and mounting of each are known.
[[nodiscard]] std::vector<ChosenCamera> choose_all_cameras(const CameraFacts& facts,
                                                           const CameraChoice& choice);

/// What a recording says about the robot before any sample.
struct RecordingSetup {
  std::optional<CameraModel> camera{};
  std::optional<SE3> base_T_cam{};
  std::vector<MountedCamera> more_cameras{};  ///< beside that one, where all cameras are used
  std::map<std::string, std::map<std::string, std::string>> metadata{};  ///< by name
  std::vector<Error> problems{};  ///< damage in the file; what could be read is read
  CameraFacts facts{};            ///< all that a recording of ROS says of cameras and frames
  ChosenCamera chosen{};          ///< which of it `camera` and `base_T_cam` are
};

/// The lens of the camera that a sample names; nullptr: not known.
[[nodiscard]] const CameraModel* lens_of(const RecordingSetup& setup, std::string_view camera);

/// Chooses the camera among the facts; of several that are all known, all of them.
void choose(RecordingSetup& setup, const CameraChoice& choice = {});

/// Turns what an IMU says into the axes of the base, where the recording says how they lie.
void turn_into_base(Sample& sample, const ChosenCamera& chosen);

}  // namespace waymark

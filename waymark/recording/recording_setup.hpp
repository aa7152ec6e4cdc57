#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/ros2/frame_tree.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A calibration of a camera in a recording (sensor_msgs/CameraInfo).
struct RecordedCameraInfo {
  std::string topic{};
  std::string frame{};
  std::optional<CameraModel> camera{};     ///< of the pictures as they come
  std::optional<CameraModel> rectified{};  ///< of the rectified ones: the projection matrix, no distortion
  std::optional<Error> error{};            ///< why there is no camera
};

/// A topic of what a camera saw: tags, their poses, or pictures.
struct RecordedView {
  std::string topic{};
  std::string frame{};
  bool picture = false;
  std::string encoding{};  ///< of raw pictures
};

/// A topic of odometry or of an IMU.
struct RecordedMotion {
  std::string topic{};
  std::string frame{};  ///< what moves: child_frame_id of odometry, the frame of an IMU
  bool imu = false;
};

/// What a recording of ROS says about cameras and frames, before anything is chosen.
struct CameraFacts {
  FrameTree frames{};
  std::vector<RecordedCameraInfo> infos{};
  std::vector<RecordedView> views{};
  std::vector<RecordedMotion> motions{};
};

/// Whether the first message of such a topic tells something that add_fact() keeps.
[[nodiscard]] bool first_message_tells(std::string_view type);

/// Takes what a message tells: its frame, a calibration, transforms. Fails on a message that does not decode.
[[nodiscard]] Status add_fact(CameraFacts& facts, std::string_view topic, std::string_view type,
                              ByteSpan cdr);

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

/// Chooses. The base is `base_frame`, else what the odometry moves (child_frame_id), else base_link or
/// base_footprint, below whatever namespace. The camera's frame is `camera_frame`, else that of the header of
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

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
#include "waymark/camera/image_lens.hpp"
#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/odometry_frames.hpp"
#include "waymark/recording/ros2/frame_tree.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A camera calibration in a recording (sensor_msgs/CameraInfo).
struct RecordedCameraInfo {
  std::string topic{};
  std::string frame{};
  std::optional<CameraModel> camera{};     ///< for the unrectified images
  std::optional<CameraModel> rectified{};  ///< for the rectified images: projection matrix, no distortion
  std::optional<Error> error{};            ///< why there is no camera model
  std::string part{};  ///< part of the image that is sent, for messages; empty if the whole image is
};

/// A topic with data from a camera: tags, tag poses or images.
struct RecordedView {
  std::string topic{};
  std::string frame{};
  bool image = false;
  std::string encoding{};  ///< encoding of raw images
  int width_px = 0;        ///< size of the first image; 0 if unknown
  int height_px = 0;
  std::optional<Error> error{};  ///< why the images cannot be read
};

/// A topic with odometry or IMU data.
struct RecordedMotion {
  std::string topic{};
  std::string frame{};  ///< child_frame_id of odometry, or the frame of an IMU
  bool imu = false;
  std::string parent{};  ///< parent frame of transforms that are odometry; otherwise empty
  /// Pose in transforms (parent_T_frame) that have not changed so far; a robot that drives has none.
  std::optional<SE3> only_pose{};

  [[nodiscard]] OdometryFrames link() const { return {topic, parent, frame}; }
};

/// Cameras and frames in a ROS recording, before any selection.
struct CameraFacts {
  FrameTree frames{};
  std::vector<RecordedCameraInfo> infos{};
  std::vector<RecordedView> views{};
  std::vector<RecordedMotion> motions{};
};

/// Whether the view is a depth image, in which no tags can be detected.
[[nodiscard]] bool shows_distances(const RecordedView& view);

/// The error of detection in a recording whose only images are depth images, which it names; empty if there
/// are other images or none.
[[nodiscard]] std::optional<Error> only_depth_images(const CameraFacts& facts);

/// Whether add_fact() uses the first message on a topic of this type.
[[nodiscard]] bool first_message_has_facts(std::string_view type);

/// Adds the contents of a message: its frame, a calibration, transforms. Fails if the message cannot be
/// decoded.
[[nodiscard]] Status add_fact(CameraFacts& facts, std::string_view topic, std::string_view type,
                              ByteSpan cdr);

/// Adds the children of odom in a message with transforms, as odometry.
[[nodiscard]] Status add_odometry_frames(CameraFacts& facts, std::string_view topic, std::string_view type,
                                         ByteSpan cdr);

/// A caller's choice of frames and topics in a recording; empty fields are determined from the recording.
struct CameraChoice {
  std::string base_frame{};
  std::string camera_frame{};
  std::string camera_topic{};    ///< topic of the camera's images, tags or calibration, or their namespace
  std::string odometry_topic{};  ///< choice if there are several
  std::string imu_topic{};       ///< choice if there are several
  bool quick = false;            ///< only the first ten seconds of moving transforms are read

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.base_frame, JobField("base_frame FRAME",
                                    "Frame of the robot's base. Default: child_frame_id of the "
                                    "odometry, else base_link or base_footprint")
                               .grouped("Recordings of other robots"));
    visit(self.camera_frame,
          JobField("camera_frame FRAME",
                   "Optical frame of the camera (x right, y down, z ahead); selects one of several cameras. "
                   "Default: the frame in the header of its tags, images or calibration")
              .grouped("Recordings of other robots"));
    visit(self.camera_topic,
          JobField("camera_topic TOPIC",
                   "Topic, or namespace such as /camera/color, of the camera to use if there are several")
              .grouped("Recordings of other robots"));
    visit(self.odometry_topic,
          JobField("odometry_topic TOPIC", "Topic of the odometry to use if there are several")
              .grouped("Recordings of other robots"));
    visit(self.imu_topic, JobField("imu_topic TOPIC", "Topic of the IMU to use if there are several")
                              .grouped("Recordings of other robots"));
  }
};

/// Whether there is odometry in transforms to a base, and each such base has moved.
[[nodiscard]] bool all_moved(const CameraFacts& facts, const CameraChoice& choice);

/// The camera selected from a recording and its mounting.
struct ChosenCamera {
  std::optional<CameraModel> camera{};
  /// The camera of rectified images, if it differs from `camera` and the recording contains only detections,
  /// which may be from either kind of image.
  std::optional<CameraModel> rectified{};
  std::optional<SE3> base_T_cam{};
  std::optional<SO3> base_R_imu{};  ///< set if the IMU axes differ from the base axes
  std::string base_frame{};
  std::string camera_frame{};
  std::string odometry{};  ///< source of the odometry: a topic, or "/tf (odom to base_link)"
  std::optional<OdometryFrames>
      odometry_frames{};                  ///< the transforms that are the odometry; empty for a topic
  std::set<std::string> unused{};         ///< topics not to read: other cameras, duplicates
  std::vector<std::string> notes{};       ///< messages about choices made among several candidates
  std::optional<Error> camera_error{};    ///< why there is no calibration
  std::optional<Error> mounting_error{};  ///< why there is no mounting; shows the frame tree
  std::optional<Error> ambiguous{};       ///< choice that must be made before the recording can be used
  std::vector<std::string> frames{};  ///< frames of the cameras if there are several and none was selected
};

/// Selects the camera and the odometry. Without nav_msgs/Odometry, the odometry is the transforms from odom
/// to base_link, base_footprint or `base_frame`, unless they never change. Of several, it is those on
/// `odometry_topic`, to a base above the camera, or from a frame called just odom. If these do not decide,
/// there is no odometry, and a note lists the transforms. The base is `base_frame`, otherwise the child frame
/// of the odometry, otherwise base_link or base_footprint in any namespace. The camera frame is
/// `camera_frame`, otherwise the frame in the header of its tags or images, otherwise that of its
/// calibration. The mounting is composed of all transforms between the two.
[[nodiscard]] ChosenCamera choose_camera(const CameraFacts& facts, const CameraChoice& choice);

/// All cameras in a recording, one per frame of tags or images, in the order of their calibrations. Empty
/// unless there are several, none was selected, and each has a calibration and a mounting.
[[nodiscard]] std::vector<ChosenCamera> choose_all_cameras(const CameraFacts& facts,
                                                           const CameraChoice& choice);

/// The calibrations that match the images in a recording, by camera name. A camera is missing if its
/// calibration is missing or ambiguous, or if it sends both raw and rectified images. If there are several
/// cameras, a calibration is matched by its frame.
[[nodiscard]] std::map<std::string, CameraModel> image_cameras(const CameraFacts& facts);

/// Data about the robot in a recording that precede its samples.
struct RecordingSetup {
  std::optional<CameraModel> camera{};
  std::optional<SE3> base_T_cam{};
  std::vector<MountedCamera> more_cameras{};  ///< additional cameras, if all cameras are used
  std::map<std::string, std::map<std::string, std::string>> metadata{};  ///< blocks by name
  std::vector<Error> problems{};  ///< damage in the file; the rest is read
  CameraFacts facts{};            ///< cameras and frames in a ROS recording
  ChosenCamera chosen{};          ///< the choice from which `camera` and `base_T_cam` were derived
};

/// The lens of the camera that a sample names.
[[nodiscard]] ImageLens lens_of(const RecordingSetup& setup, std::string_view camera);

/// Selects the camera from `facts`. If several are complete and none was selected, selects all of them.
void choose(RecordingSetup& setup, const CameraChoice& choice = {});

/// Rotates IMU measurements into the axes of the base, if the recording contains the rotation.
void turn_into_base(Sample& sample, const ChosenCamera& chosen);

}  // namespace waymark

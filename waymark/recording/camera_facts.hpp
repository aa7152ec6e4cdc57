#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/frame_tree.hpp"

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

}  // namespace waymark

#include "waymark/cli/frame_flags.hpp"

#include "waymark/cli/flags.hpp"

namespace waymark::cli {

void add_frame_flags(CLI::App& app, CameraChoice& choice) {
  const char* group = "Recordings of other robots";
  add_option(app, "--base-frame FRAME", choice.base_frame,
             "Frame of the robot's base. Unless given: child_frame_id of the odometry, else base_link or "
             "base_footprint",
             in_group(group));
  add_option(app, "--camera-frame FRAME", choice.camera_frame,
             "Optical frame of the camera (x right, y down, z ahead); of several cameras the one with this "
             "frame. Unless given: that of the header of its tags, pictures or calibration",
             in_group(group));
  add_option(app, "--camera-topic TOPIC", choice.camera_topic,
             "Topic, or namespace such as /camera/color, of the camera to use, of several", in_group(group));
  add_option(app, "--odometry-topic TOPIC", choice.odometry_topic, "Topic of the odometry to use, of several",
             in_group(group));
  add_option(app, "--imu-topic TOPIC", choice.imu_topic, "Topic of the IMU to use, of several",
             in_group(group));
}

}  // namespace waymark::cli

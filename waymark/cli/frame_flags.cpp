#include "waymark/cli/frame_flags.hpp"

#include <CLI/App.hpp>

namespace waymark::cli {

void add_frame_flags(CLI::App& app, CameraChoice& choice) {
  const char* group = "Recordings of other robots";
  app.add_option("--base-frame", choice.base_frame,
                 "Frame of the robot's base. Unless given: child_frame_id of the odometry, else base_link or "
                 "base_footprint")
      ->type_name("FRAME")
      ->group(group);
  app.add_option(
         "--camera-frame", choice.camera_frame,
         "Optical frame of the camera (x right, y down, z ahead); of several cameras the one with this "
         "frame. Unless given: that of the header of its tags, pictures or calibration")
      ->type_name("FRAME")
      ->group(group);
  app.add_option("--camera-topic", choice.camera_topic,
                 "Topic, or namespace such as /camera/color, of the camera to use, of several")
      ->type_name("TOPIC")
      ->group(group);
  app.add_option("--odometry-topic", choice.odometry_topic, "Topic of the odometry to use, of several")
      ->type_name("TOPIC")
      ->group(group);
  app.add_option("--imu-topic", choice.imu_topic, "Topic of the IMU to use, of several")
      ->type_name("TOPIC")
      ->group(group);
}

}  // namespace waymark::cli

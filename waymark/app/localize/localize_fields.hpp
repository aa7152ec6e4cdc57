#pragma once

#include "waymark/base/fields.hpp"

/// Fields shared by the jobs of `waymark localize`.
namespace waymark::localize_fields {

inline JobField map() {
  return JobField("map FILE",
                  "Tag map: map.yaml or its folder, the Robotics Academy's apriltags_poses.yaml, a CSV file "
                  "with id, x, y, or a WPILib or Limelight field layout")
      .required();
}
inline JobField tag_size_m() {
  return {"tag_size_m NUMBER", "Tag size if the map contains none (0.24 for the Academy's maps)"};
}
inline JobField calibration() { return {"calibration FILE", "Calibration of this robot (calibration.yaml)"}; }
inline JobField start() {
  return JobField("start NUMBER", "Initial pose of the robot, if known: x y [m], yaw [deg]").parts(3);
}
inline JobField camera() {
  return {"camera FILE",
          "Camera calibration (calibration.yaml, ROS camera_info, kalibr YAML or PhotonVision JSON)"};
}
/// For live robots and cameras.
inline JobField duration_s() {
  return {"duration_s NUMBER", "End after this many seconds. Default: at Ctrl-C", 0.01, 1e6};
}
inline JobField record_images() {
  return JobField("record_images HOW", "Record the images as well: jpeg, or raw (ten times as large)")
      .one_of("jpeg,raw")
      .less();
}
inline JobField every_s() {
  return JobField("every_s NUMBER", "Time between printed lines", 0.01, 1e6).less();
}

}  // namespace waymark::localize_fields

#pragma once

#include <ignition/msgs/camera_info.pb.h>
#include <ignition/msgs/image.pb.h>

#include "waymark/robots/gazebo/gazebo_link.hpp"

namespace waymark {

/// A picture in grey: of L_INT8, L_INT16, RGB_INT8, BGR_INT8, RGBA_INT8, BGRA_INT8. Fails on other formats
/// and on a picture that is smaller than it says.
[[nodiscard]] Result<CameraFrame> from_ignition(const ignition::msgs::Image& message);
/// RGB_INT8, as Gazebo's cameras send.
[[nodiscard]] ignition::msgs::Image to_ignition(const CameraFrame& frame);

/// Fails on numbers that are no camera, and on a distortion of another model than PLUMB_BOB.
[[nodiscard]] Result<GazeboCamera> from_ignition(const ignition::msgs::CameraInfo& message);
[[nodiscard]] ignition::msgs::CameraInfo to_ignition(const GazeboCamera& camera);

}  // namespace waymark

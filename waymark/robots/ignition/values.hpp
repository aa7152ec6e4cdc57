#pragma once

#include <string>
#include <string_view>

#include <ignition/msgs/camera_info.pb.h>
#include <ignition/msgs/header.pb.h>
#include <ignition/msgs/image.pb.h>
#include <ignition/msgs/pose.pb.h>
#include <ignition/msgs/twist.pb.h>

#include "waymark/base/error.hpp"
#include "waymark/robots/gazebo/gazebo_link.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// The timestamp in a header, in simulated time.
[[nodiscard]] SensorTime from_ignition(const ignition::msgs::Time& time);
[[nodiscard]] ignition::msgs::Time to_ignition(SensorTime stamp);
/// A header with the frames, as written by Gazebo's systems.
[[nodiscard]] ignition::msgs::Header header(SensorTime stamp, const std::string& frame,
                                            const std::string& child_frame = {});
/// The value for a key in a header ("frame_id", "child_frame_id"); empty if there is none.
[[nodiscard]] std::string header_value(const ignition::msgs::Header& header, const std::string& key);

/// Fails if the orientation is not a rotation. If the orientation is missing, it is the identity.
[[nodiscard]] Result<SE3> from_ignition(const ignition::msgs::Pose& pose);
[[nodiscard]] ignition::msgs::Pose to_ignition(const SE3& pose);
[[nodiscard]] VelocityCommand from_ignition(const ignition::msgs::Twist& twist);
[[nodiscard]] ignition::msgs::Twist to_ignition(const VelocityCommand& velocity);

/// A grey image from L_INT8, L_INT16, RGB_INT8, BGR_INT8, RGBA_INT8 or BGRA_INT8. Fails for other formats, or
/// if there is less data than the image size requires.
[[nodiscard]] Result<CameraFrame> from_ignition(const ignition::msgs::Image& message);
/// Uses the encoding RGB_INT8, as Gazebo's cameras do.
[[nodiscard]] ignition::msgs::Image to_ignition(const CameraFrame& frame);

/// Fails if camera parameters are invalid or the distortion model is not PLUMB_BOB.
[[nodiscard]] Result<GazeboCamera> from_ignition(const ignition::msgs::CameraInfo& message);
[[nodiscard]] ignition::msgs::CameraInfo to_ignition(const GazeboCamera& camera);

/// Parses a serialised message with a type such as "ignition.msgs.Odometry". Fails if the type is not
/// supported, the bytes are not a message of this type, or its contents are invalid (an image with too little
/// data).
[[nodiscard]] Result<GazeboValue> parse_gazebo(std::string_view type, std::string_view bytes);

/// type_of() returns the message type for a value, and serialize_gazebo() serialises it. Poses become a
/// Pose_V.
[[nodiscard]] std::string type_of(const GazeboValue& value);
[[nodiscard]] std::string serialize_gazebo(const GazeboValue& value);

}  // namespace waymark

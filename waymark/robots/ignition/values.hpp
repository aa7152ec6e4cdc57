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

/// The stamp of a header, simulated time.
[[nodiscard]] SensorTime from_ignition(const ignition::msgs::Time& time);
[[nodiscard]] ignition::msgs::Time to_ignition(SensorTime stamp);
/// With the frames that Gazebo's systems put there.
[[nodiscard]] ignition::msgs::Header header(SensorTime stamp, const std::string& frame,
                                            const std::string& child_frame = {});
/// What a header says of a key: "frame_id", "child_frame_id"; empty: nothing.
[[nodiscard]] std::string header_value(const ignition::msgs::Header& header, const std::string& key);

/// Fails on an orientation that is no rotation; one that was not sent is none.
[[nodiscard]] Result<SE3> from_ignition(const ignition::msgs::Pose& pose);
[[nodiscard]] ignition::msgs::Pose to_ignition(const SE3& pose);
[[nodiscard]] VelocityCommand from_ignition(const ignition::msgs::Twist& twist);
[[nodiscard]] ignition::msgs::Twist to_ignition(const VelocityCommand& velocity);

/// A picture in grey: of L_INT8, L_INT16, RGB_INT8, BGR_INT8, RGBA_INT8, BGRA_INT8. Fails on other formats
/// and on a picture that is smaller than it says.
[[nodiscard]] Result<CameraFrame> from_ignition(const ignition::msgs::Image& message);
/// RGB_INT8, as Gazebo's cameras send.
[[nodiscard]] ignition::msgs::Image to_ignition(const CameraFrame& frame);

/// Fails on numbers that are no camera, and on a distortion of another model than PLUMB_BOB.
[[nodiscard]] Result<GazeboCamera> from_ignition(const ignition::msgs::CameraInfo& message);
[[nodiscard]] ignition::msgs::CameraInfo to_ignition(const GazeboCamera& camera);

/// The value of a serialised message of a type such as "ignition.msgs.Odometry". Fails on a type that is not
/// read, on bytes that are none of it, and on contents that make no sense (a picture smaller than it says).
[[nodiscard]] Result<GazeboValue> parse_gazebo(std::string_view type, std::string_view bytes);

/// A value as a serialised message, and the type of it. Poses are a Pose where it is one, else a Pose_V.
[[nodiscard]] std::string type_of(const GazeboValue& value);
[[nodiscard]] std::string serialize_gazebo(const GazeboValue& value);

}  // namespace waymark

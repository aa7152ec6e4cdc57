#pragma once

#include <string>

#include <ignition/msgs/header.pb.h>
#include <ignition/msgs/pose.pb.h>
#include <ignition/msgs/twist.pb.h>

#include "waymark/base/error.hpp"
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

}  // namespace waymark

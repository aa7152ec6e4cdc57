#pragma once

#include <string>
#include <string_view>

#include "waymark/robots/gazebo/gazebo_link.hpp"

namespace waymark {

/// The value of a serialised message of a type such as "ignition.msgs.Odometry". Fails on a type that is not
/// read, on bytes that are none of it, and on contents that make no sense (a picture smaller than it says).
[[nodiscard]] Result<GazeboValue> parse_gazebo(std::string_view type, std::string_view bytes);

/// A value as a serialised message, and the type of it. Poses are a Pose where it is one, else a Pose_V.
[[nodiscard]] std::string type_of(const GazeboValue& value);
[[nodiscard]] std::string serialize_gazebo(const GazeboValue& value);

}  // namespace waymark

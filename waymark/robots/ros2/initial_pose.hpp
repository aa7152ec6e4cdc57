#pragma once

#include <cstdint>
#include <span>

#include "waymark/base/error.hpp"
#include "waymark/localization/method.hpp"

namespace waymark {

inline constexpr const char* kInitialPoseTopic = "/initialpose";

/// Reads a pose set by an operator: geometry_msgs/msg/PoseWithCovarianceStamped in CDR with its encapsulation
/// header, as sent by RViz's "2D Pose Estimate". Only x, y and yaw of the covariance are used. Fails if the
/// bytes are not such a message, the frame is not map, or a number is not finite. Also fails if the pose is
/// not upright or the covariance is not positive definite.
[[nodiscard]] Result<GivenPose> read_initial_pose(std::span<const std::uint8_t> cdr);

}  // namespace waymark

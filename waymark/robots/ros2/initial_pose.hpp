#pragma once

#include <cstdint>
#include <span>

#include "waymark/base/error.hpp"
#include "waymark/localization/method.hpp"

namespace waymark {

inline constexpr const char* kInitialPoseTopic = "/initialpose";

/// Reads a pose set by an operator: geometry_msgs/msg/PoseWithCovarianceStamped in CDR with its
/// encapsulation, as sent by RViz's "2D Pose Estimate". Only x, y and yaw of the covariance are used. Fails
/// on bytes that are not such a message, a frame other than map, non-finite numbers, a pose that is not
/// upright, or a covariance that is not positive definite.
[[nodiscard]] Result<GivenPose> read_initial_pose(std::span<const std::uint8_t> cdr);

}  // namespace waymark

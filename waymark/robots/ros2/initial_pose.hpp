#pragma once

#include <cstdint>
#include <span>

#include "waymark/base/error.hpp"
#include "waymark/localization/method.hpp"

namespace waymark {

inline constexpr const char* kInitialPoseTopic = "/initialpose";

/// Where somebody says that the robot is: geometry_msgs/msg/PoseWithCovarianceStamped in CDR with its
/// encapsulation, as RViz's "2D Pose Estimate" sends it. Of the covariance x, y and the turn about z count.
/// Fails on bytes that are no such message, another frame than map, numbers that are none, a robot that does
/// not stand upright, and a covariance that is not positive definite.
[[nodiscard]] Result<GivenPose> read_initial_pose(std::span<const std::uint8_t> cdr);

}  // namespace waymark

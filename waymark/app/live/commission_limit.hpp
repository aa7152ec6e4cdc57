#pragma once

#include <optional>
#include <string>

#include "waymark/app/live/robot_setup.hpp"
#include "waymark/robots/process/robot_messages.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/robot_samples.hpp"

/// Until its first drive (`waymark commission`) has passed, a real robot is driven slowly.
namespace waymark {

inline constexpr double kUncommissionedSpeed_m_s = 0.15;

/// Why a robot is limited to kUncommissionedSpeed_m_s, and the command that lifts it, in a sentence; nothing
/// for a robot that is simulated, and for one whose file holds a commission that passed and still counts.
[[nodiscard]] std::optional<std::string> lacks_commission(const RobotSetup& setup, const RobotHello& hello);

/// The command on the same arc, no faster than this, and within the robot's speed and yaw rate: nobody who
/// drives it, and no program, can ask for more.
[[nodiscard]] VelocityCommand slowed(const VelocityCommand& command, double most_m_s,
                                     const MotionLimits& limits);

}  // namespace waymark

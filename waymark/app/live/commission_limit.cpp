#include "waymark/app/live/commission_limit.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/shell_word.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {

std::optional<std::string> lacks_commission(const RobotSetup& setup, const RobotHello& hello) {
  if (!hello.is_real()) return std::nullopt;
  std::string why = "holds no first drive";
  if (setup.commissioned) {
    const auto changes = changes_since(*setup.commissioned, setup.simulated.model, setup.ground);
    if (setup.commissioned->passed && changes.empty()) return std::nullopt;
    why = !setup.commissioned->passed
              ? fmt::format("holds a first drive that did not pass ({})",
                            fmt::join(setup.commissioned->failed, ", "))
              : fmt::format("holds a first drive that no longer counts: {}", fmt::join(changes, "; "));
  }
  return fmt::format(
      "the robot's file {} {}. Until one has passed it is driven at {:g} m/s at most: "
      "waymark commission --robot {} --robot-file {}",
      setup.robot_path, printable(why), kUncommissionedSpeed_m_s, shell_word(setup.ground.robot),
      shell_word(setup.robot_path));
}

VelocityCommand slowed(const VelocityCommand& command, double most_m_s, const MotionLimits& limits) {
  double share = 1;
  const auto bound = [&share](double value, double most) {
    if (std::abs(value) > most) share = std::min(share, most / std::abs(value));
  };
  bound(command.speed_m_s, std::min(most_m_s, limits.speed_m_s));
  bound(command.yaw_rate_rad_s, limits.yaw_rate_rad_s);
  return {share * command.speed_m_s, share * command.yaw_rate_rad_s};
}

}  // namespace waymark

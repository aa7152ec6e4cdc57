#pragma once

#include <functional>

#include "waymark/drivers/mbot/lcm_link.hpp"
#include "waymark/drivers/simulated/simulated_lap.hpp"

namespace waymark {

/// Which publisher of tags an MBot has.
enum class MbotGeneration : std::uint8_t {
  Jetson,  ///< quaternions x, y, z, w; stamped when they are published
  Pi5,     ///< quaternions w, x, y, z; never stamped (utime 0)
};

/// Runs a simulated robot in real time as an MBot on LCM, until should_stop() says so: channels, types, units
/// and signs of a real one's log, stamped by this machine's clock; TRUE_POSE (pose2D_t) beside them, for
/// judges. It obeys MBOT_VEL_CMD and stops when commands cease, as the robot of the setup does. Tags are sent
/// as poses, 65 ms after the exposure.
[[nodiscard]] Status run_mbot_robot_sim(LcmLink& link, const SimulatedSetup& setup, const SE2& start,
                                        MbotGeneration generation, const std::function<bool()>& should_stop);

}  // namespace waymark

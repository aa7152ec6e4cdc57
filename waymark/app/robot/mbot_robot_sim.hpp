#pragma once

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

/// Which publisher of tags an MBot has.
enum class MbotGeneration : std::uint8_t {
  Jetson,  ///< quaternions x, y, z, w; stamped when they are published
  Pi5,     ///< quaternions w, x, y, z; never stamped (utime 0)
};

/// Runs a plant in real time as an MBot on LCM with the setup's camera and tags, until it is cancelled:
/// channels, types, units and signs of a real one's log, stamped by this machine's clock; TRUE_POSE
/// (pose2D_t) beside them, for judges. It obeys MBOT_VEL_CMD. Tags are sent as poses, 65 ms after the
/// exposure.
[[nodiscard]] Status run_mbot_robot_sim(LcmLink& link, Plant& plant, const SimulatedSetup& setup,
                                        MbotGeneration generation, const JobControl& control);

}  // namespace waymark

#pragma once

#include <cstdint>
#include <string>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

/// Which publisher of tags an MBot has.
enum class MbotGeneration : std::uint8_t {
  Jetson,  ///< quaternions x, y, z, w; stamped when they are published
  Pi5,     ///< quaternions w, x, y, z; never stamped (utime 0)
};

/// Of the publisher of tags, by its name: "jetson" or "pi5".
[[nodiscard]] inline MbotGeneration mbot_generation(const std::string& name) {
  return name == "pi5" ? MbotGeneration::Pi5 : MbotGeneration::Jetson;
}

struct MbotSimOptions {
  std::string address = "udpm://239.255.76.67:7667?ttl=0";
  std::string generation = "jetson";  ///< as mbot_generation() has it

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.address, JobField("mbot ADDRESS", "Address of the robot on LCM").input().also("mbot"));
    visit(self.generation,
          JobField("mbot_generation NAME",
                   "Publisher of tags of the MBot: jetson (quaternions x, y, z, w) or pi5 (w, x, y, z; no "
                   "stamps)")
              .one_of("jetson,pi5")
              .less());
  }
};

/// Runs a plant in real time as an MBot on LCM with the setup's camera and tags, until it is cancelled:
/// channels, types, units and signs of a real one's log, stamped by this machine's clock; TRUE_POSE
/// (pose2D_t) beside them, for judges. It obeys MBOT_VEL_CMD. Tags are sent as poses, 65 ms after the
/// exposure.
[[nodiscard]] Status run_mbot_robot_sim(LcmLink& link, Plant& plant, const SimulatedSetup& setup,
                                        MbotGeneration generation, const JobControl& control);

}  // namespace waymark

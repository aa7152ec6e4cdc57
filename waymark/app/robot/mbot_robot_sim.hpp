#pragma once

#include <cstdint>
#include <string>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

/// The program that publishes the tags on an MBot.
enum class MbotGeneration : std::uint8_t {
  Jetson,  ///< quaternions x, y, z, w; timestamped on publishing
  Pi5,     ///< quaternions w, x, y, z; never timestamped (utime 0)
};

/// Parses the name of the tag publisher: "jetson" or "pi5".
[[nodiscard]] inline MbotGeneration mbot_generation(const std::string& name) {
  return name == "pi5" ? MbotGeneration::Pi5 : MbotGeneration::Jetson;
}

struct MbotSimOptions {
  std::string address = "udpm://239.255.76.67:7667?ttl=0";
  std::string generation = "jetson";  ///< text parsed by mbot_generation()

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

/// Simulates, in real time and until cancelled, an MBot on LCM with the camera and the tags of the setup.
/// Channels, types, units and signs are those in the log of a real MBot. Messages are timestamped by the
/// clock of this machine; TRUE_POSE (pose2D_t) contains the ground truth. The robot obeys MBOT_VEL_CMD. Tags
/// are sent as poses, 65 ms after the exposure.
[[nodiscard]] Status run_mbot_robot_sim(LcmLink& link, Plant& plant, const SimulatedSetup& setup,
                                        MbotGeneration generation, const JobControl& control);

}  // namespace waymark

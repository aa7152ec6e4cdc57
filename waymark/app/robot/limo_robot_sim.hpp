#pragma once

#include <functional>
#include <memory>
#include <string>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/app/robot/wire_faults.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

struct LimoSimOptions {
  std::string
      beside{};  ///< named pipe, made where there is none, for what is not on LIMO's wire; empty: none
  WireFaultOptions faults{};  ///< both ways
  std::uint64_t seed = 1;     ///< of the faults
};

/// Runs a plant in real time as a LIMO with the wheels of the setup at the other end of a pseudo-terminal,
/// until it is cancelled: frames at the rates of its sensors, its state ten times a second. It obeys
/// after it was asked to (0x421). `on_port` is told the path of the terminal once. Pictures or tags, the
/// lidar and the truth go to the pipe as lines of a robot process, stamped by this machine's steady clock:
/// those that nobody reads in time are dropped.
[[nodiscard]] Status run_limo_robot_sim(Plant& plant, const SimulatedSetup& setup,
                                        const LimoSimOptions& options,
                                        const std::function<void(const std::string&)>& on_port,
                                        const JobControl& control);

}  // namespace waymark

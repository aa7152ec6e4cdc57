#pragma once

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

/// How a robot of `waymark robot-sim` keeps time.
struct SimulatedProcessOptions {
  bool lockstep = false;  ///< time stands still until each step is answered
  double pace = 0;        ///< with lockstep: at most so many seconds of the world a second; 0: any
};

/// Runs the plant of a setup that speaks the protocol of robot processes on standard output and listens on
/// standard input, until that ends or it is cancelled.
[[nodiscard]] Status run_simulated_process(Plant& plant, const SimulatedSetup& setup,
                                           const SimulatedProcessOptions& options, const JobControl& control);

}  // namespace waymark

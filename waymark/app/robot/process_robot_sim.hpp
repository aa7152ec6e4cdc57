#pragma once

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

/// Determines the clock of a simulated robot process (`waymark robot-sim process`).
struct ProcessSimOptions {
  bool lockstep = false;  ///< whether simulated time waits for the response to each step
  double pace = 0;        ///< maximum real-time factor in lockstep; as fast as possible if 0

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.lockstep,
          JobField("lockstep",
                   "Lockstep: simulated time advances with each answer, as fast as possible and "
                   "with the same samples in every run"));
    visit(
        self.pace,
        JobField(
            "pace FLOAT",
            "Maximum real-time factor with `lockstep`: simulated seconds per second; 0: as fast as possible",
            0.0, 100.0)
            .usually("0"));
  }
};

/// Runs the plant of a setup as a robot process on standard input and output, until the input ends or the
/// control cancels.
[[nodiscard]] Status run_process_robot_sim(Plant& plant, const SimulatedSetup& setup,
                                           const ProcessSimOptions& options, const JobControl& control);

}  // namespace waymark

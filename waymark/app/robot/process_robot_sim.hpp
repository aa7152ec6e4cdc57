#pragma once

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

/// How a simulated robot process (`waymark robot-sim process`) keeps time.
struct ProcessSimOptions {
  bool lockstep = false;  ///< time stands still until each step is answered
  double pace = 0;        ///< with lockstep: at most so many seconds of the world a second; 0: any

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.lockstep,
          JobField("lockstep",
                   "Lockstep: simulated time advances with each answer, as fast as the machine "
                   "allows and with the same samples every time"));
    visit(
        self.pace,
        JobField(
            "pace FLOAT",
            "Maximum real-time factor with `lockstep`: simulated seconds per second; 0: as fast as possible",
            0.0, 100.0)
            .usually("0"));
  }
};

/// Runs the plant of a setup that speaks the protocol of robot processes on standard output and listens on
/// standard input, until that ends or it is cancelled.
[[nodiscard]] Status run_process_robot_sim(Plant& plant, const SimulatedSetup& setup,
                                           const ProcessSimOptions& options, const JobControl& control);

}  // namespace waymark

#pragma once

#include <functional>
#include <memory>

#include "waymark/drivers/simulated/simulated_lap.hpp"
#include "waymark/drivers/simulated/simulated_robot.hpp"

namespace waymark {

/// How a robot of `waymark robot-sim` keeps time.
struct SimulatedProcessOptions {
  bool lockstep = false;  ///< time stands still until each step is answered
  double pace = 0;        ///< with lockstep: at most so many seconds of the world a second; 0: any
};

/// Runs a simulated robot that speaks the protocol of robot processes on standard output and listens on
/// standard input, until that ends or it is cancelled.
/// Without `scene_camera` it sends corners of tags instead of pictures.
[[nodiscard]] Status run_simulated_process(const SimulatedSetup& setup, const SE2& start,
                                           std::unique_ptr<DetectingCamera> scene_camera,
                                           const SimulatedProcessOptions& options,
                                           const std::function<bool()>& cancelled);

}  // namespace waymark

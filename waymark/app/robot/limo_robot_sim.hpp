#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/base/random.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

/// What a bad cable does to the bytes of a serial wire.
struct WireFaultOptions {
  double noise = 0;    ///< probability of each byte to become another one
  double dropped = 0;  ///< probability of each byte to be lost
  double torn = 0;     ///< probability of each frame to lose its end
};

/// Deterministic by seed.
class WireFaults {
 public:
  WireFaults(const WireFaultOptions& options, std::uint64_t seed) : options_(options), random_(seed) {}

  /// A frame as the other end receives it.
  [[nodiscard]] std::string pass(std::span<const std::uint8_t> frame);

 private:
  WireFaultOptions options_;
  Random random_;
};

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

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

/// What a bad cable does to the bytes of a serial wire.
struct WireFaultOptions {
  double noise = 0;    ///< probability of each byte to become another one
  double dropped = 0;  ///< probability of each byte to be lost
  double torn = 0;     ///< probability of each frame to lose its end

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.noise, JobField("wire_noise FLOAT",
                               "Probability of each byte of LIMO's wire to become another one", 0.0, 1.0)
                          .usually("0")
                          .less());
    visit(self.dropped,
          JobField("wire_dropped FLOAT", "Probability of each byte of LIMO's wire to be lost", 0.0, 1.0)
              .usually("0")
              .less());
    visit(self.torn,
          JobField("wire_torn FLOAT", "Probability of each frame of LIMO's wire to lose its end", 0.0, 1.0)
              .usually("0")
              .less());
  }
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

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.beside,
          JobField("beside FIFO",
                   "Named pipe for what is not on LIMO's wire: camera, lidar, truth, as lines for "
                   "`waymark limo robot beside=true`"));
    WireFaultOptions::fields(self.faults, visit);
  }
};

/// Runs a plant in real time as a LIMO with the wheels of the setup at the other end of a pseudo-terminal,
/// until it is cancelled: frames at the rates of its sensors, its state ten times a second. It obeys
/// after it was asked to (0x421). `on_port` is told the path of the terminal once. Pictures or tags, the
/// lidar and the truth go to the pipe as lines of a robot process, stamped by this machine's steady clock:
/// those that nobody reads in time are dropped. The faults of the wire are drawn by the seed of the setup's
/// robot.
[[nodiscard]] Status run_limo_robot_sim(Plant& plant, const SimulatedSetup& setup,
                                        const LimoSimOptions& options,
                                        const std::function<void(const std::string&)>& on_port,
                                        const JobControl& control);

}  // namespace waymark

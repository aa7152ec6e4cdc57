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

/// Faults of a bad cable on a serial wire.
struct WireFaultOptions {
  double noise = 0;    ///< probability that a byte is changed
  double dropped = 0;  ///< probability that a byte is lost
  double torn = 0;     ///< probability that a frame loses its end

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.noise,
          JobField("wire_noise FLOAT", "Probability that a byte on LIMO's wire is changed", 0.0, 1.0)
              .usually("0")
              .less());
    visit(self.dropped,
          JobField("wire_dropped FLOAT", "Probability that a byte on LIMO's wire is lost", 0.0, 1.0)
              .usually("0")
              .less());
    visit(self.torn,
          JobField("wire_torn FLOAT", "Probability that a frame on LIMO's wire loses its end", 0.0, 1.0)
              .usually("0")
              .less());
  }
};

/// Deterministic by seed.
class WireFaults {
 public:
  WireFaults(const WireFaultOptions& options, std::uint64_t seed) : options_(options), random_(seed) {}

  /// The frame as received at the other end.
  [[nodiscard]] std::string pass(std::span<const std::uint8_t> frame);

 private:
  WireFaultOptions options_;
  Random random_;
};

struct LimoSimOptions {
  std::string
      beside{};  ///< named pipe, created if missing, for data that are not on LIMO's wire; empty: none
  WireFaultOptions faults{};  ///< in both directions

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.beside,
          JobField("beside FIFO",
                   "Named pipe for data that are not on LIMO's wire: camera, lidar, ground truth, as lines "
                   "for `waymark limo robot beside=true`"));
    WireFaultOptions::fields(self.faults, visit);
  }
};

/// Runs a plant in real time as a LIMO with the wheels of the setup at the other end of a pseudo-terminal,
/// until cancelled. It sends frames at the rates of its sensors and its state at 10 Hz, and obeys commands
/// after a request (0x421). `on_port` gets the path of the terminal once. Images or tags, lidar and ground
/// truth go to the pipe as lines of a robot process, stamped by this machine's steady clock. Lines that are
/// not read in time are dropped. The faults of the wire depend on the seed of the setup's robot.
[[nodiscard]] Status run_limo_robot_sim(Plant& plant, const SimulatedSetup& setup,
                                        const LimoSimOptions& options,
                                        const std::function<void(const std::string&)>& on_port,
                                        const JobControl& control);

}  // namespace waymark

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

/// Faults that a bad cable causes on a serial line.
struct WireFaultOptions {
  double noise = 0;    ///< probability that a byte is changed
  double dropped = 0;  ///< probability that a byte is lost
  double torn = 0;     ///< probability that the end of a frame is lost

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

/// Applies the faults. Deterministic for a given seed.
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
  std::string beside{};  ///< named pipe, created if missing, for data that LIMO does not send over its wire;
                         ///< not used if empty
  WireFaultOptions faults{};  ///< faults in both directions

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.beside,
          JobField("beside FIFO",
                   "Named pipe for data that are not on LIMO's wire: camera, lidar, ground truth, as lines "
                   "for `waymark limo robot beside=true`"));
    WireFaultOptions::fields(self.faults, visit);
  }
};

/// Simulates, in real time and until cancelled, a LIMO with the wheels of the setup at the other end of a
/// pseudo-terminal. Frames are sent at the rates of its sensors and its state at 10 Hz; commands are obeyed
/// after a request (0x421). `on_port` is called once with the path of the terminal. Images or tags, lidar and
/// ground truth are written to the pipe as lines of a robot process, timestamped by the steady clock of this
/// machine. Lines that are not read in time are dropped. The wire faults depend on the seed of the robot in
/// the setup.
[[nodiscard]] Status run_limo_robot_sim(Plant& plant, const SimulatedSetup& setup,
                                        const LimoSimOptions& options,
                                        const std::function<void(const std::string&)>& on_port,
                                        const JobControl& control);

}  // namespace waymark

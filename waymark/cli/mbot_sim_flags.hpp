#pragma once

#include <string>

#include "waymark/live/mbot_robot_sim.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// Of a simulated robot that is an MBot on LCM.
struct MbotSimFlags {
  explicit MbotSimFlags(CLI::App& app);
  MbotSimFlags(const MbotSimFlags&) = delete;
  MbotSimFlags& operator=(const MbotSimFlags&) = delete;

  [[nodiscard]] bool chosen() const { return !address.empty(); }
  /// The whole drive, until Ctrl-C. Fails where there is no such network.
  [[nodiscard]] Status run(Plant& plant, const SimulatedSetup& setup) const;

  std::string address{};
  std::string generation = "jetson";
};

}  // namespace waymark::cli

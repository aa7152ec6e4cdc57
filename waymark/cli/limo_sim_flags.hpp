#pragma once

#include "waymark/live/limo_robot_sim.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// The flags --limo, --beside and --wire-… of a simulated LIMO.
struct LimoSimFlags {
  explicit LimoSimFlags(CLI::App& app);
  LimoSimFlags(const LimoSimFlags&) = delete;
  LimoSimFlags& operator=(const LimoSimFlags&) = delete;

  bool chosen = false;
  LimoSimOptions options{};
};

}  // namespace waymark::cli

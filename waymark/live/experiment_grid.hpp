#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/live/robot_setup.hpp"

namespace waymark {

inline constexpr const char* kNoFaults = "none";

/// What is combined with what.
struct ExperimentGrid {
  std::vector<std::string> worlds = {"circuit24"};
  std::vector<std::string> robots = {"limo"};
  std::vector<std::string> controllers = {"follower"};
  std::vector<std::string> faults = {kNoFaults};
  std::vector<double> speeds_m_s = {0.4};
  std::vector<std::uint64_t> seeds = {1};
  double laps = 1;
  bool images = false;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.worlds, Field{"worlds", "Names of built-in worlds or paths of world files."});
    visit(self.robots, Field{"robots", "Names of built-in robots or paths of robot files."});
    visit(self.controllers, Field{"controllers", "Controllers to compare: follower, pursuit, pose."});
    visit(self.faults, Field{"faults", "Paths of fault scripts; none: no fault is injected."});
    visit(self.speeds_m_s, Field{"speeds_m_s", "Reference speeds of the replay."});
    visit(self.seeds, Field{"seeds", "Random seeds of the taught lap; the replay uses the seed plus 1000."});
    visit(self.laps, Field{"laps", "Number of laps of a closed route.", 0.01, 1000});
    visit(self.images,
          Field{"images",
                "Render pictures and detect tags in them; without it, corners with noise take their place."});
  }
};

/// A world and a robot of the grid, as the seed of the teach lap makes them.
[[nodiscard]] Result<RobotSetup> setup_of(const ExperimentGrid& grid, const std::string& world,
                                          const std::string& robot, std::uint64_t seed);

/// Looks at everything the grid names, before the first lap is driven. Place of an error: the key.
[[nodiscard]] Status check_grid(const ExperimentGrid& grid);

}  // namespace waymark

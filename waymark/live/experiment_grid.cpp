#include "waymark/live/experiment_grid.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "waymark/base/suggest.hpp"
#include "waymark/config/faults_file.hpp"
#include "waymark/pipeline/replayer.hpp"

namespace waymark {

Result<RobotSetup> setup_of(const ExperimentGrid& grid, const std::string& world, const std::string& robot,
                            std::uint64_t seed) {
  Result<RobotSetup> setup = load_setup(world, robot, seed);
  if (setup && grid.images) setup->simulated.pictures.emplace();
  return setup;
}

Status check_grid(const ExperimentGrid& grid) {
  for (const auto& [key, count] :
       {std::pair("worlds", grid.worlds.size()), std::pair("robots", grid.robots.size()),
        std::pair("controllers", grid.controllers.size()), std::pair("faults", grid.faults.size()),
        std::pair("speeds_m_s", grid.speeds_m_s.size()), std::pair("seeds", grid.seeds.size())}) {
    if (count == 0)
      return fail(ErrorCode::InvalidArgument, "an empty list: nothing would be driven", {.key = key},
                  "Name at least one, or leave the key out.");
  }
  std::vector<std::uint64_t> seeds = grid.seeds;
  std::ranges::sort(seeds);
  if (const auto twice = std::ranges::adjacent_find(seeds); twice != seeds.end())
    return fail(ErrorCode::InvalidArgument,
                fmt::format("seed {} is named twice: it would be the same drive", *twice), {.key = "seeds"});
  const std::vector<std::string> known = replay_controllers();
  for (const std::string& name : grid.controllers) {
    if (std::ranges::find(known, name) == known.end())
      return fail(ErrorCode::InvalidArgument, fmt::format("there is no controller '{}'", name),
                  {.key = "controllers"}, suggestion(name, known));
  }
  for (const double speed : grid.speeds_m_s) {
    if (!(speed > 0 && speed <= 5))
      return fail(ErrorCode::InvalidArgument, fmt::format("{} is outside (0, 5]", speed),
                  {.key = "speeds_m_s"});
  }
  for (const std::string& world : grid.worlds) {
    for (const std::string& robot : grid.robots) {
      const Result<RobotSetup> setup = setup_of(grid, world, robot, 1);
      if (!setup) return tl::unexpected(setup.error());
      for (const std::string& faults : grid.faults) {
        if (faults == kNoFaults) continue;
        if (const auto read = read_faults(faults, setup->simulated.world); !read)
          return tl::unexpected(read.error());
      }
    }
  }
  return {};
}

}  // namespace waymark

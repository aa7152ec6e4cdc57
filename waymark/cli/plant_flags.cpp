#include "waymark/cli/plant_flags.hpp"

#include <string_view>

#include <CLI/App.hpp>

#include "waymark/cli/console.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/settings.hpp"
#include "waymark/live/process_plant.hpp"
#include "waymark/live/simulated_plant.hpp"
#include "waymark/simulation/path.hpp"

namespace waymark::cli {
namespace {

constexpr std::string_view kProcess = "process:";

Result<std::unique_ptr<Plant>> at_begin_of_line(const SimulatedSetup& setup) {
  constexpr double kStep_m = 0.02;
  const auto path = sample_path(setup.world.path_m, setup.world.path_closed, kStep_m);
  if (path.empty())
    return fail(ErrorCode::InvalidArgument, "the world has no line (path_m), at whose begin the robot starts",
                {.source = setup.world.name});
  return make_simulated_plant(setup, path.front().map_T_path);
}

}  // namespace

PlantFlags::PlantFlags(CLI::App& app) {
  CLI::Option* option = app.add_option(
      "--plant", given_,
      "Simulation behind the wire instead of Waymark's: process:CMD, a program that speaks the "
      "protocol of robot processes. World and robot file say which camera, wheels and tags it has");
  option->type_name("ROBOT")->group(kMoreGroup);
  option->check([](const std::string& given) {
    const bool right = given.starts_with(kProcess) && given.size() > kProcess.size();
    return right ? std::string() : "'" + given + "' is no process:CMD (docs/formats/robot-process.md)";
  });
}

RobotCommand PlantFlags::process() const {
  return chosen() ? RobotCommand(given_.substr(kProcess.size())) : RobotCommand();
}

Result<std::unique_ptr<Plant>> PlantFlags::make(const RobotSetup& setup,
                                                const std::vector<std::string>& sends,
                                                Console& console) const {
  if (!chosen()) return at_begin_of_line(setup.simulated);
  return start_process_plant(setup.process,
                             {.sends = sends,
                              .watchdog_s = setup.simulated.robot.watchdog_s,
                              .should_stop = interrupted,
                              .on_text = [&console](const std::string& text) { console.say(text); }});
}

}  // namespace waymark::cli

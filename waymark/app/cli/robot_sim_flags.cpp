#include "waymark/app/cli/robot_sim_flags.hpp"

#include <utility>

namespace waymark::cli {

RobotSimFlags::RobotSimFlags(CLI::App& verb, PlantFlag plant, Images images)
    : settings_(verb), setup_(verb), images_(settings_, Reach::Flags, false, images) {
  if (plant == PlantFlag::None) return;
  add_option(verb, "--plant ROBOT", plant_,
             "Simulation behind the wire instead of Waymark's: process:CMD, a program with the protocol "
             "of robot processes. World and robot file specify its camera, wheels and tags",
             kMore)
      ->check([](const std::string& given) {
        return plant_command(given) ? std::string()
                                    : "'" + given + "' is not process:CMD (docs/formats/robot-process.md)";
      });
}

ExitCode RobotSimFlags::run(const Result<SimWire>& wire, Console& console) const {
  Result<RobotSetup> setup = setup_.make();
  if (setup && !plant_.empty()) setup->process = *plant_command(plant_);
  setup = images_.apply(std::move(setup));
  if (!setup) return fail_usage(setup.error(), console);
  if (!wire) return fail_usage(wire.error(), console);
  if (plant_.empty())
    if (const Status fits = fit_to_wire(*wire, setup->simulated); !fits)
      return fail_usage(fits.error(), console);
  const JobControl control = control_from(console);
  const auto plant = make_plant(*wire, *setup, control);
  if (!plant) return fail_with(plant.error(), console);
  const auto print_port = [&](const std::string& path) { console.print(path + "\n"); };
  const Status ended = run_robot_sim(*wire, **plant, setup->simulated, print_port, control);
  return ended ? ExitCode::Ok : fail_with(ended.error(), console);
}

}  // namespace waymark::cli

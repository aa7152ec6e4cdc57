#include "waymark/cli/limo_sim_flags.hpp"

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "waymark/cli/settings.hpp"

namespace waymark::cli {

LimoSimFlags::LimoSimFlags(CLI::App& app) {
  CLI::Option* const limo = app.add_flag("--limo", chosen,
                                         "Be a LIMO on a serial port, in real time, until Ctrl-C: a "
                                         "pseudo-terminal, whose path is printed");
  app.add_option(
         "--beside", options.beside,
         "Named pipe for what is not on LIMO's wire: camera, lidar, truth, as lines for `waymark limo "
         "robot --beside`")
      ->needs(limo)
      ->type_name("FIFO");
  const auto add = [&app, limo](const char* name, double& value, const char* help) {
    app.add_option(name, value, help)
        ->needs(limo)
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str()
        ->type_name("FLOAT")
        ->group(kMoreGroup);
  };
  add("--wire-noise", options.faults.noise, "Probability of each byte of LIMO's wire to become another one");
  add("--wire-dropped", options.faults.dropped, "Probability of each byte of LIMO's wire to be lost");
  add("--wire-torn", options.faults.torn, "Probability of each frame of LIMO's wire to lose its end");
}

}  // namespace waymark::cli

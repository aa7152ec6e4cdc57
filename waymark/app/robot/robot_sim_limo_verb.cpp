#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_sim_flags.hpp"

namespace waymark::cli {
namespace {

struct LimoSimArgs {
  explicit LimoSimArgs(CLI::App& verb) : flags(verb) {
    add_fields(verb, options);
    add_choice(verb, "--limo");
  }

  RobotSimFlags flags;
  LimoSimOptions options{};
};

ExitCode run_limo(const LimoSimArgs& args, Console& console) {
  return args.flags.run(SimWire(args.options), console);
}

}  // namespace

Verb robot_sim_limo_verb() {
  return {
      .name = "limo",
      .sentence = "Simulate a LIMO on a serial port: a pseudo-terminal, whose path is printed",
      .help =
          R"(Prints the path of a pseudo-terminal with the protocol of LIMO's base on its serial port, in real time, until
Ctrl-C: for --robot limo:PORT (docs/howto/limo.md). Like LIMO, it obeys commands after a request. Data that are not on
that wire (camera, lidar, ground truth) go to the named pipe of --beside, which is created if missing. The flags
--wire-noise, --wire-dropped and --wire-torn simulate a bad cable.
Exit code: 0 ended by Ctrl-C, 1 an image could not be rendered, or the pipe cannot be used, 2 wrong usage.

Example:
  waymark robot-sim limo --world circuit24 --beside /tmp/limo-beside
)",
      .prepare = prepared(run_limo)};
}

}  // namespace waymark::cli

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
      .sentence = "A LIMO on a serial port: a pseudo-terminal, whose path is printed",
      .help =
          R"(Prints the path of a pseudo-terminal and speaks there as LIMO's base does on its serial port, in real time, until
Ctrl-C: for --robot limo:PORT (docs/howto/limo.md). It obeys commands after it was asked to, as LIMO does. What is not on
that wire (camera, lidar, truth) goes to the named pipe of --beside, which is made where there is none. --wire-noise,
--wire-dropped and --wire-torn make a bad cable of it.

Exit code: 0 ended by Ctrl-C, 1 a picture could not be made, or the pipe cannot be used, 2 wrong usage.

Example:
  waymark robot-sim limo --world circuit24 --beside /tmp/limo-beside
)",
      .prepare = prepared(run_limo)};
}

}  // namespace waymark::cli

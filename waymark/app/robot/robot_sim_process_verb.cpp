#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_sim_flags.hpp"

namespace waymark::cli {
namespace {

struct ProcessSimArgs {
  explicit ProcessSimArgs(CLI::App& verb) : verb(verb), flags(verb, PlantFlag::None) {
    add_fields(verb, options);
  }

  const CLI::App& verb;
  RobotSimFlags flags;
  ProcessSimOptions options{};
};

ExitCode run_process(const ProcessSimArgs& args, Console& console) {
  Refusals refused(args.verb);
  refused.fields(!args.options.lockstep, {"pace"}, "has no effect without `lockstep`",
                 "Add `lockstep`, or omit `pace`.");
  if (!refused.status()) return fail_usage(refused.status().error(), console);
  return args.flags.run(SimWire(args.options), console);
}

}  // namespace

Verb robot_sim_process_verb() {
  return {.name = "process",
          .sentence = "Simulate a robot process: JSON lines on standard input and output; the default",
          .help =
              R"(Writes sensor data as JSON lines to standard output and reads commands from standard input
(docs/formats/robot-process.md): to try the protocol, or as a robot for --robot process:CMD. It starts at the
beginning of the world's path, in real time unless --lockstep is given, and ends with its input. With --images it
sends images (JPEG), otherwise tag corners. It also sends ground truth. Your own simulation with this protocol needs
no adapter: --robot process:CMD drives it directly.
Exit code: 0 ended by its input or Ctrl-C, 1 an image could not be rendered, 2 wrong usage.

Examples:
  waymark robot-sim process --world circuit24 < /dev/null | head -3
  waymark teach --robot "process:waymark robot-sim --world circuit24 --lockstep" --world circuit24 -o lap.mcap
)",
          .prepare = prepared(run_process)};
}

}  // namespace waymark::cli

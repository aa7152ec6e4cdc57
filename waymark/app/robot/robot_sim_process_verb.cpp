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
  refused.fields(!args.options.lockstep, {"pace"}, "without lockstep the robot goes by the clock",
                 "Add `lockstep`, or leave it out.");
  if (!refused.status()) return fail_usage(refused.status().error(), console);
  return args.flags.run(SimWire(args.options), console);
}

}  // namespace

Verb robot_sim_process_verb() {
  return {
      .name = "process",
      .sentence = "A robot process: JSON lines on standard input and output; the usual one",
      .help =
          R"(Writes what the robot senses as JSON lines on standard output and reads commands from standard input,
as docs/formats/robot-process.md says: to try the protocol, or as a robot for --robot process:CMD. It starts
where the world's line begins, in real time unless --lockstep, and ends when its input does. With --images
it sends pictures (JPEG), otherwise the corners of tags. It also sends the truth, for a judge. A simulation of your own
that speaks this protocol is a robot already: --robot process:CMD drives it as it is.

Exit code: 0 its input or a Ctrl-C ended it, 1 a picture could not be made, 2 wrong usage.

Examples:
  waymark robot-sim process --world circuit24 < /dev/null | head -3
  waymark teach --robot "process:waymark robot-sim --world circuit24 --lockstep" --world circuit24 -o lap.mcap
)",
      .prepare = prepared(run_process)};
}

}  // namespace waymark::cli

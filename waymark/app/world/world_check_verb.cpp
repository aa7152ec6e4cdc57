#include "waymark/app/cli/parts.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/world/judge_world.hpp"

namespace waymark::cli {
namespace {

using CheckArgs = JobArgs<CheckWorldRequest>;

ExitCode check(const CheckArgs& args, Console& console) {
  const Result<RobotSetup> setup = load_setup(args.job.world, args.job.robot_file, 1);
  if (!setup) return fail_usage(setup.error(), console);
  const SimulatedSetup& s = setup->simulated;
  const Result<WorldVerdict> verdict = judge_world(s.world, s.model, s.camera, s.robot.tag_camera);
  if (!verdict) return fail_with(verdict.error(), console);
  for (const std::string& warning : verdict->warnings) console.note("warning: " + warning);
  console.print(args.json ? json_line(fields(*verdict)) : to_text(*verdict, s.world, s.model));
  if (!verdict->good) console.note("this world does not allow a good lap");
  return verdict->good ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb world_check_verb() {
  return {
      .name = "check",
      .sentence = "Check whether a robot can drive a good lap in a world",
      .help =
          R"(Follows the line in the world exactly, without noise. Prints the smallest distance from the hull to a tag, and the
fraction of the line along which two or more tags are in view. Lists overlapping tags, and tags that are hidden by other
tags along a part of the line.

Exit code: 0 a good lap is possible, 1 it is not possible, or a file cannot be read, 2 wrong usage.

Examples:
  waymark world check circuit24
  waymark world check circuit24 --robot-file limo --json
)",
      .prepare = prepared(check),
      .report = report_of<WorldVerdict>};
}

}  // namespace waymark::cli

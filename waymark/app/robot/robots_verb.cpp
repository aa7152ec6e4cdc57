#include "waymark/app/cli/parts.hpp"
#include "waymark/app/robot/robot_table.hpp"

namespace waymark::cli {
namespace {

/// A file that cannot be read is said, and the others are listed.
ExitCode list_all(Console& console) {
  const auto robots = robot_table();
  if (!robots) return fail_with(robots.error(), console);
  console.print(robots->text);
  for (const Error& error : robots->errors) console.say(error);
  return robots->errors.empty() ? ExitCode::Ok : ExitCode::SomeFailed;
}

ExitCode explain(const std::string& name, Console& console) {
  const auto text = explained_robot(name);
  if (!text) return fail_with(text.error(), console);
  console.print(*text);
  return ExitCode::Ok;
}

struct RobotsArgs {
  explicit RobotsArgs(CLI::App& app) {
    add_option(app, "robot NAME", name,
               "Name of a robot, or the path of a .yaml file; without it all are listed");
  }

  std::string name;
};

ExitCode robots(const RobotsArgs& args, Console& console) {
  return args.name.empty() ? list_all(console) : explain(args.name, console);
}

}  // namespace

Verb robots_verb() {
  return {
      .name = "robots",
      .sentence = "List and explain the files of robots",
      .help =
          R"(Without a name: the robots that come with Waymark, one a line. With one: its body, limits, wheels, cameras and
their mounting, its latencies in simulation, where the facts are from, and how it is driven. A file of yours is checked
the same way: a key that is missing or wrong is named with its line (docs/formats/robot.md).

Exit code: 0 all files are sound, 1 one is not, 2 wrong usage.

Examples:
  waymark robots
  waymark robots limo
)",
      .prepare = prepared(robots)};
}

}  // namespace waymark::cli

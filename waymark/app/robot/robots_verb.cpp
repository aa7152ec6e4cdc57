#include "waymark/app/cli/parts.hpp"
#include "waymark/app/robot/robot_table.hpp"

namespace waymark::cli {
namespace {

/// Lists the robots, and prints an error for each unreadable file.
ExitCode list_all(Console& console) {
  const auto robots = robot_table();
  if (!robots) return fail_with(robots.error(), console);
  console.print(robots->text);
  for (const Error& error : robots->errors) console.note(error);
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
    add_option(app, "robot NAME", name, "Name of a robot, or path of a .yaml file. Default: list all robots");
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
      .sentence = "List and describe robot files",
      .help =
          R"(Without a name, lists the robots that come with Waymark, one per line. With a name, prints body, limits, wheels,
cameras with mounting, latencies in simulation, sources of the data, and how to connect to the robot. Checks your own
file in the same way, and reports missing or invalid keys with their line (docs/formats/robot.md).
Exit code: 0 all files are valid, 1 a file is not, 2 wrong usage.

Examples:
  waymark robots
  waymark robots limo
)",
      .prepare = prepared(robots)};
}

}  // namespace waymark::cli

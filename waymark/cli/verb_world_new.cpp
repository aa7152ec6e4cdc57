#include "waymark/cli/parts.hpp"
#include "waymark/config/robot_list.hpp"
#include "waymark/jobs/lay_world.hpp"

namespace waymark::cli {
namespace {

struct NewArgs {
  explicit NewArgs(CLI::App& app) : settings(app), layout(settings, "layout", kFirstGroup) {
    add_option(app, "--path FILE", path,
               "Line to drive: a .csv file with columns x and y in metres, or a recording of a drive",
               kRequired);
    add_option(app, "-o,--output FILE", output, "World to write (.yaml)", kRequired);
    add_option(app, "--robot-file NAME", robot_file, "Body and camera of the robot: a name, or a .yaml file",
               kShown);
    app.add_flag("--json", json, "One JSON object instead of words");
  }

  Settings settings;
  std::string path;
  std::string robot_file = "limo";
  std::string output;
  bool json = false;
  OptionFlags<TagLayoutOptions> layout;
};

Result<LayWorldJob> job_of(const NewArgs& args) {
  TagLayoutOptions layout;
  if (Status status = args.layout.apply(layout); !status) return tl::unexpected(status.error());
  auto robot = read_named_robot(args.robot_file);
  if (!robot) return tl::unexpected(robot.error());
  if (Status fresh = check_new_world(args.output); !fresh) return tl::unexpected(fresh.error());
  return LayWorldJob{.path = args.path, .output = args.output, .robot = std::move(*robot), .layout = layout};
}

ExitCode make_world(const NewArgs& args, Console& console) {
  const Result<LayWorldJob> job = job_of(args);
  if (!job) return console.failed(job.error(), ExitCode::Usage);
  const Result<LayWorldReport> report = lay_world(*job, control_from(console));
  if (!report) return console.failed(report.error(), ExitCode::SomeFailed);
  console.print(args.json ? json_line(to_json(*report, args.output)) : to_text(*report, args.output));
  return ExitCode::Ok;
}

}  // namespace

Verb world_new_verb() {
  return {
      .name = "new",
      .sentence = "A world with tags laid along a line that was drawn or driven",
      .help =
          R"(Puts upright tags beside the line, as few as it takes for the camera to see two of them from everywhere, none
nearer to the hull than --clearance-m (measured in space), and says how well that went. A line that comes back
to its beginning is a lap.

Exit code: 0 a world was written, 1 the line could not be read or no tag placed, 2 wrong usage.

Example:
  waymark world new --path lap.mcap -o mine.yaml --tag-size-m 0.12
)",
      .prepare = prepared(make_world)};
}

}  // namespace waymark::cli

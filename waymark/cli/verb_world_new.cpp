#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/share.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/lay_world.hpp"
#include "waymark/jobs/staged_folder.hpp"

namespace waymark::cli {
namespace {

struct NewArgs {
  explicit NewArgs(CLI::App& app) : settings(app), layout(app, settings, "layout", kFirstGroup) {}

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
  const auto robot_path = find_shared("robots", args.robot_file);
  if (!robot_path) return tl::unexpected(robot_path.error());
  auto robot = read_robot(*robot_path);
  if (!robot) return tl::unexpected(robot.error());
  std::error_code ignored;
  if (std::filesystem::is_regular_file(args.output, ignored))
    return fail(ErrorCode::InvalidArgument, "the file exists", {.source = args.output},
                "Choose another name, or remove it.");
  if (Status writable = check_output_file(args.output); !writable) return tl::unexpected(writable.error());
  return LayWorldJob{.path = args.path, .output = args.output, .robot = std::move(*robot), .layout = layout};
}

ExitCode make_world(const NewArgs& args, Console& console) {
  const Result<LayWorldJob> job = job_of(args);
  if (!job) return console.failed(job.error(), ExitCode::Usage);
  const Result<LayWorldReport> report = lay_world(*job, control_from(console));
  if (!report)
    return console.failed(report.error(), interrupted() ? ExitCode::Interrupted : ExitCode::SomeFailed);
  console.print(args.json ? json_line(to_json(*report, args.output)) : to_text(*report, args.output));
  return ExitCode::Ok;
}

Run prepare_world_new(CLI::App& app) {
  const auto args = std::make_shared<NewArgs>(app);
  app.add_option("--path", args->path,
                 "Line to drive: a .csv file with columns x and y in metres, or a recording of a drive")
      ->required()
      ->type_name("FILE");
  app.add_option("-o,--output", args->output, "World to write (.yaml)")->required()->type_name("FILE");
  app.add_option("--robot-file", args->robot_file, "Body and camera of the robot: a name, or a .yaml file")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return make_world(*args, console); };
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
      .prepare = prepare_world_new,
      .verbs = {}};
}

}  // namespace waymark::cli

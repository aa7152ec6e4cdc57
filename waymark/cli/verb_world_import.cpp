#include <filesystem>
#include <memory>
#include <string>

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/cli/warnings.hpp"
#include "waymark/jobs/import_world.hpp"
#include "waymark/jobs/json_line.hpp"

namespace waymark::cli {
namespace {

struct ImportArgs {
  ImportWorldJob job{};
  bool json = false;
};

ExitCode import_sdf(const ImportArgs& args, Console& console) {
  const auto report = import_world(args.job, control_from(console));
  if (!report)
    return console.failed(report.error(), interrupted() ? ExitCode::Interrupted : ExitCode::SomeFailed);
  say_warnings(report->warnings, console);
  const std::string file = args.job.output.string();
  console.print(args.json ? json_line(to_json(*report, file)) : to_text(*report, file));
  return ExitCode::Ok;
}

Run prepare_import(CLI::App& app) {
  const auto args = std::make_shared<ImportArgs>();
  app.add_option("FILE", args->job.file, "World or model in SDF (.sdf, .world)")->required()->type_name("");
  app.add_option("-o,--output", args->job.output, "World to write (.yaml)")->required()->type_name("FILE");
  app.add_option(
         "--models", args->job.folders,
         "Folder in which model:// and pictures are looked for first (repeatable). Then: beside the file, "
         "models/ there, IGN_GAZEBO_RESOURCE_PATH, SDF_PATH")
      ->type_name("FOLDER");
  app.add_option("--family", args->job.families, "Tag families to look for in the pictures")
      ->capture_default_str()
      ->delimiter(',')
      ->type_name("NAME");
  auto* path =
      app.add_option("--path", args->job.path,
                     "Line to drive: a .csv file with columns x and y in metres, or a recording of a drive");
  path->type_name("FILE");
  app.add_option("--start", args->job.start,
                 "Model from which a line of one metre leads ahead, where there is no --path. Unless given: "
                 "the first "
                 "model that is not static, else the origin")
      ->excludes(path)
      ->type_name("NAME");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return import_sdf(*args, console); };
}

}  // namespace

Verb world_import_verb() {
  return {
      .name = "import",
      .sentence = "Make a world of one in SDF (Gazebo)",
      .help =
          R"(Reads a world of Gazebo (SDF, parsed by SDFormat 12), finds the tags in its textures with the detector, whatever
their files are called, and places them by how the texture lies on box, plane or mesh. Upright boxes and cylinders
become furniture. Robots and other models that are not static are left out, lights are listed. What is left out, or
taken for something simpler, is a warning.

Exit code: 0 written, 1 no tag was found, or the file could not be read, 2 wrong usage.

Examples:
  waymark world import walls.sdf -o walls.yaml
  waymark world import hall.sdf --models models --family tag36h11,tag25h9 --path lap.csv -o hall.yaml
)",
      .prepare = prepare_import,
      .verbs = {}};
}

}  // namespace waymark::cli

#include "waymark/cli/parts.hpp"
#include "waymark/jobs/import_world.hpp"

namespace waymark::cli {
namespace {

struct ImportArgs {
  explicit ImportArgs(CLI::App& app) {
    add_option(app, "FILE", job.file, "World or model in SDF (.sdf, .world)", kRequired);
    add_option(app, "-o,--output FILE", job.output, "World to write (.yaml)", kRequired);
    add_option(app, "--models FOLDER", job.folders,
               "Folder in which model:// and pictures are looked for first (repeatable). Then: beside the "
               "file, models/ there, IGN_GAZEBO_RESOURCE_PATH, SDF_PATH");
    add_option(app, "--family NAME", job.families, "Tag families to look for in the pictures", kShown,
               kByCommas);
    auto* path = app.add_option(
        "--path", job.path,
        "Line to drive: a .csv file with columns x and y in metres, or a recording of a drive");
    path->type_name("FILE");
    add_option(app, "--start NAME", job.start,
               "Model from which a line of one metre leads ahead, where there is no --path. Unless given: "
               "the first model that is not static, else the origin")
        ->excludes(path);
    app.add_flag("--json", json, "One JSON object instead of words");
  }

  ImportWorldJob job{};
  bool json = false;
};

ExitCode import_sdf(const ImportArgs& args, Console& console) {
  const auto report = import_world(args.job, control_from(console));
  if (!report) return console.failed(report.error(), ExitCode::SomeFailed);
  console.warn(report->warnings);
  const std::string file = args.job.output.string();
  console.print(args.json ? json_line(to_json(*report, file)) : to_text(*report, file));
  return ExitCode::Ok;
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
      .prepare = prepared(import_sdf)};
}

}  // namespace waymark::cli

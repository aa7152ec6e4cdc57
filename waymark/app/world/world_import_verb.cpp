#include "waymark/app/cli/parts.hpp"
#include "waymark/app/world/import_world.hpp"

namespace waymark::cli {
namespace {

using ImportArgs = JobArgs<ImportWorldJob>;

ExitCode import_sdf(const ImportArgs& args, Console& console) {
  const auto report = import_world(args.job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.warn(report->warnings);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report));
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
      .prepare = prepared(import_sdf),
      .report = report_of<ImportWorldReport>};
}

}  // namespace waymark::cli

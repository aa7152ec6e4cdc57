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
      .sentence = "Convert an SDF world (Gazebo) to a Waymark world",
      .help =
          R"(Reads a Gazebo world (SDF, parsed with SDFormat 12) and detects the tags in its textures, regardless of file names. Tag
poses are determined from the texture coordinates on a box, plane or mesh. Upright boxes and cylinders become furniture.
Models that are not static, such as robots, are omitted; lights are listed. Omissions and simplifications are reported
as warnings.

Exit code: 0 the world was written, 1 no tag was found, or the file could not be read, 2 wrong usage.

Examples:
  waymark world import walls.sdf -o walls.yaml
  waymark world import hall.sdf --models models --family tag36h11,tag25h9 --path lap.csv -o hall.yaml
)",
      .prepare = prepared(import_sdf),
      .report = report_of<ImportWorldReport>};
}

}  // namespace waymark::cli

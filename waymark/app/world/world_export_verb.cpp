#include "waymark/app/cli/parts.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/world/export_world.hpp"

namespace waymark::cli {
namespace {

using ExportArgs = JobArgs<ExportWorldRequest>;

ExitCode export_as_sdf(const ExportArgs& args, Console& console) {
  const Result<RobotSetup> setup = load_setup(args.job.world, args.job.robot_file, 1);
  if (!setup) return fail_usage(setup.error(), console);
  const auto report = export_world({.world = setup->simulated.world,
                                    .robot = setup->robot(),
                                    .robot_yaml = setup->robot_yaml,
                                    .folder = args.job.folder});
  if (!report) return fail_with(report.error(), console);
  console.warn(report->notes);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report, args.job.folder));
  return ExitCode::Ok;
}

}  // namespace

Verb world_export_verb() {
  return {
      .name = "export",
      .sentence = "Write a world and a robot as SDF, for Gazebo Fortress",
      .help =
          R"(Writes world.sdf (SDF 1.9), the bitmaps of the tags, robot.yaml, and gazebo.yaml, the profile used by Waymark to drive
the robot in Gazebo. The world contains the tags as textured planes, boards, walls, furniture, light, and the robot with
its diff-drive plugin, camera, IMU and lidar. See docs/howto/gazebo.md.

Exit code: 0 the folder was written, 1 a file cannot be read, or the folder cannot be written, 2 wrong usage.

Examples:
  waymark world export circuit24 --sdf circuit
  waymark world export my_world.yaml --robot-file my_robot.yaml --sdf mine
)",
      .prepare = prepared(export_as_sdf),
      .report = report_of<ExportWorldReport>};
}

}  // namespace waymark::cli

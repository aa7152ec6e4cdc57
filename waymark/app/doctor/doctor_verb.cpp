#include "waymark/app/cli/parts.hpp"
#include "waymark/app/doctor/doctor.hpp"

namespace waymark::cli {
namespace {

struct DoctorArgs : JobArgs<DoctorJob> {
  explicit DoctorArgs(CLI::App& app) : JobArgs(app, "One JSON object instead of lines") {}
};

ExitCode examine(const DoctorArgs& args, Console& console) {
  const auto report = run_doctor(args.job, interrupted);
  if (!report) return fail_by_kind(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report));
  return any_failed(*report) ? ExitCode::SomeFailed : ExitCode::Ok;
}

}  // namespace

Verb doctor_verb() {
  return {
      .name = "doctor",
      .sentence = "Check robot, cameras, calibration, disk and processor before a drive",
      .help =
          R"(One line a check: ok, warn or fail, what was found, and below it the command that mends it or tells more.
Cameras: each device, whether this user may open it, and who uses it. Calibration: age, and what it could not
tell. Robot: its port (is it there, who may open it, who has it) or its network (peers, qualities of service), the
rate of its odometry, the difference of its clock, who else commands it, battery, errors. Devices: serial ports and
gamepads, and whether this user may open them. Map: the tags of a map that should be found from where the
camera stands, and why some are not: covered, too faint or blurred. Disk: the room for recordings. Processor: the
loop of a robot runs for two seconds on drawn pictures.

Exit code: 0 nothing failed, 1 a check failed, 2 wrong usage, 130 ended by Ctrl-C.

Examples:
  waymark doctor
  waymark doctor --robot ros2:limo
  waymark doctor --camera calibration.yaml --camera-source v4l2:/dev/video0 --rate-hz 60
  waymark doctor --camera calibration.yaml --camera-source v4l2:/dev/video0 --map map
  waymark doctor --camera calibration.yaml --camera-source v4l2:/dev/video0 --tag-at-m 1 --tag-size-m 0.16
)",
      .prepare = prepared(examine),
      .report = report_of<DoctorReport>};
}

}  // namespace waymark::cli

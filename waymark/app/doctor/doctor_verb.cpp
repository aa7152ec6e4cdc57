#include "waymark/app/cli/parts.hpp"
#include "waymark/app/doctor/doctor.hpp"

namespace waymark::cli {
namespace {

struct DoctorArgs : JobArgs<DoctorJob> {
  explicit DoctorArgs(CLI::App& app) : JobArgs(app, "Print one JSON object instead of lines") {}
};

/// The report with commands that users can copy, in which fields are replaced by flags.
DoctorReport with_flags_in_commands(DoctorReport report, const Console& console) {
  for (DoctorLine& line : report.checks) {
    if (!line.command.starts_with("waymark ")) continue;
    const std::string quoted = console.text_for_users("`" + line.command + "`");
    line.command = quoted.substr(1, quoted.size() - 2);
  }
  return report;
}

ExitCode examine(const DoctorArgs& args, Console& console) {
  const auto checked = run_doctor(args.job, interrupted);
  if (!checked) return fail_by_kind(checked.error(), console);
  const DoctorReport report = with_flags_in_commands(*checked, console);
  console.print(args.json ? json_line(fields(report)) : to_text(report));
  return any_failed(report) ? ExitCode::SomeFailed : ExitCode::Ok;
}

}  // namespace

Verb doctor_verb() {
  return {
      .name = "doctor",
      .sentence = "Check robot, cameras, calibration, disk and processor before a drive",
      .help =
          R"(Prints one line per check: ok, warn or fail, and the result; below it a command that fixes it or prints more.
Cameras: each device, its permissions, and the program that uses it. Calibration: age and unobservable parameters.
Robot: its port (existence, permissions, other programs) or its network (peers, qualities of service), rate of the
odometry, clock offset, other programs with commands, battery, errors. Devices: serial ports and gamepads, with
permissions. Map: map tags expected at the camera's pose but not detected, with the reason: covered, too faint or
blurred. Disk: space for recordings. Processor: two seconds of the robot loop on synthetic images.

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

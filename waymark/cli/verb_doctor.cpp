#include "waymark/cli/parts.hpp"
#include "waymark/live/doctor_job.hpp"

namespace waymark::cli {
namespace {

struct DoctorArgs {
  explicit DoctorArgs(CLI::App& app) {
    add_option(app, "--robot NAME", job.robot,
               "Robot to listen to, without moving it: limo:PORT, mbot:ADDRESS, ros2:PROFILE or "
               "gazebo:PROFILE, for example limo:/dev/ttyTHS1");
    add_option(
        app, "--camera FILE", job.calibration,
        "Calibration to look at. Unless given: calibration.yaml in the current folder, if there is one");
    add_option(app, "--camera-source ADDRESS", job.sources,
               "Camera to open and to take pictures from for a second, for example v4l2:/dev/video0");
    add_option(app, "--tag-at-m FLOAT", job.tag.distance_m,
               "Measure the printed size of a tag that hangs at this distance, from the front of the lens to "
               "its centre, measured with a tape to a centimetre",
               between(0.2, 20.0))
        ->needs("--camera-source");
    add_option(app, "--tag-size-m FLOAT", job.tag.size_m,
               "Side that the black square of that tag should have", between(0.001, 10.0))
        ->needs("--tag-at-m");
    app.get_option("--tag-at-m")->needs("--tag-size-m");
    add_option(app, "--family NAME", job.tag.families, "Families that the tag may be of", kShown, kByCommas)
        ->needs("--tag-at-m");
    add_option(app, "--map FILE", job.map,
               "Map whose tags should be in view of these cameras, map.yaml or its folder: which of them are "
               "missed where the camera stands, and why")
        ->needs("--camera-source");
    add_option(app, "--folder PATH", job.folder, "Folder in which recordings will be written", kShown);
    add_option(app, "--width-px INTEGER", job.trial.width, "Width of the pictures of the trial", kShown,
               between(64, 8192));
    add_option(app, "--height-px INTEGER", job.trial.height, "Height of the pictures of the trial", kShown,
               between(64, 8192));
    add_option(app, "--rate-hz FLOAT", job.trial.rate_hz, "Rate of the pictures of the trial", kShown,
               between(0.1, 1000.0));
    app.add_flag("--json", json, "One JSON object instead of lines");
  }

  DoctorJob job{};
  bool json = false;
};

ExitCode examine(const DoctorArgs& args, Console& console) {
  const auto lines = run_doctor(args.job, interrupted);
  if (!lines) {
    const ErrorCode code = lines.error().code;  // a file or profile that is named wrongly, too
    const bool usage = code == ErrorCode::InvalidArgument || code == ErrorCode::NotFound;
    return console.failed(lines.error(), usage ? ExitCode::Usage : ExitCode::SomeFailed);
  }
  console.print(args.json ? json_line(to_json(*lines)) : to_text(*lines));
  return any_failed(*lines) ? ExitCode::SomeFailed : ExitCode::Ok;
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
      .prepare = prepared(examine)};
}

}  // namespace waymark::cli

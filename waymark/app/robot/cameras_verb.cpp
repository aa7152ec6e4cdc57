#include "waymark/app/cli/parts.hpp"
#include "waymark/app/live/cameras.hpp"

namespace waymark::cli {
namespace {

struct CamerasArgs : JobArgs<CamerasJob> {
  explicit CamerasArgs(CLI::App& app)
      : JobArgs(app, "Print one JSON object instead of a list, with all controls") {}
};

ExitCode list(const CamerasArgs& args, Console& console) {
  const auto report = find_cameras(args.job);
  if (!report) return console.failed(report.error(), ExitCode::SomeFailed);
  if (args.json) console.print(json_line(fields(*report)));
  if (report->cameras.empty())
    console.note("this computer has no camera: none of /dev/video* delivers images");
  else if (!args.json)
    console.print(to_text(*report, args.job.controls));
  return ExitCode::Ok;
}

}  // namespace

Verb cameras_verb() {
  return {
      .name = "cameras",
      .sentence = "List the cameras of this computer, with their formats and controls",
      .help =
          R"(Lists each device with its name, its link in /dev/v4l/by-id (independent of the USB socket), formats, sizes,
rates, and the controls that matter for measurements. A camera address, for `waymark detect`, `waymark convert` and
--camera-source, is v4l2: and the device, then comma-separated options. The options are size=1280x720, rate=30,
format=MJPG (GREY, NV12, YUYV, UYVY), and any control by its name (exposure_ms=5, gain=20). The option lock switches
off the automatic modes of exposure, gain, focus and white balance.
Exit code: 0 listed (also without a camera), 1 the given device cannot be used, 2 wrong usage.

Examples:
  waymark cameras
  waymark cameras /dev/video0 --controls
)",
      .prepare = prepared(list),
      .report = report_of<CamerasReport>};
}

}  // namespace waymark::cli

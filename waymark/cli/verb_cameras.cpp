#include "waymark/cli/parts.hpp"
#include "waymark/live/cameras_text.hpp"

namespace waymark::cli {
namespace {

struct CamerasArgs {
  explicit CamerasArgs(CLI::App& app) {
    add_option(app, "DEVICE", device, "Only this device, for example /dev/video0");
    app.add_flag("--controls", controls,
                 "List all controls, not only exposure, gain, focus and white balance");
    app.add_flag("--json", json, "One JSON object instead of a list, with all controls");
  }

  std::string device;
  bool controls = false;
  bool json = false;
};

ExitCode list(const CamerasArgs& args, Console& console) {
  std::vector<CameraDevice> devices;
  if (args.device.empty()) {
    devices = list_cameras();
  } else {
    auto one = describe_camera(args.device);
    if (!one) return console.failed(one.error(), ExitCode::SomeFailed);
    devices.push_back(std::move(*one));
  }
  if (args.json) console.print(json_line(to_json(devices)));
  if (devices.empty())
    console.say("this computer has no camera: none of /dev/video* delivers pictures");
  else if (!args.json)
    console.print(to_text(devices, args.controls));
  return ExitCode::Ok;
}

}  // namespace

Verb cameras_verb() {
  return {
      .name = "cameras",
      .sentence = "List the cameras of this computer, with their formats and controls",
      .help =
          R"(Each device with its name, its link that stays the same whatever the socket (/dev/v4l/by-id), formats,
sizes, rates and the controls that matter for measuring. Addresses of cameras, for `waymark detect`, `waymark
convert` and --camera-source, are v4l2: and the device, and behind it, with commas: size=1280x720, rate=30,
format=MJPG (GREY, NV12, YUYV, UYVY), any control by its name (exposure_ms=5, gain=20), and lock, which switches
the automatic modes of exposure, gain, focus and white balance off.

Exit code: 0 listed (also where there is none), 1 the device that was named cannot be used, 2 wrong usage.

Examples:
  waymark cameras
  waymark cameras /dev/video0 --controls
)",
      .prepare = prepared(list)};
}

}  // namespace waymark::cli

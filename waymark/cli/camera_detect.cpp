#include "waymark/cli/camera_detect.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/base/counted.hpp"
#include "waymark/cli/console_control.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/jobs/detections_text.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/live/camera_address.hpp"

namespace waymark::cli {
namespace {

/// What is about one camera, where several are named.
Status check_several(const CLI::App& app, const std::vector<std::string>& sources) {
  if (sources.size() < 2) return {};
  for (auto source = sources.begin(); source != sources.end(); ++source)
    if (std::find(sources.begin(), source, *source) != source)
      return fail(ErrorCode::InvalidArgument, "this camera is named twice", {.source = *source},
                  "Name each camera once.");
  Status status;
  for (const char* flag : {"--view", "--camera"})
    if (status)
      status = refuse_flag(app, flag, "this is about one camera, and several are named",
                           "Run the program once for each camera.");
  return status;
}

ExitCode say_ends(const std::vector<DetectedCamera>& cameras, Console& console) {
  console.end_progress();
  ExitCode code = interrupted() ? ExitCode::Interrupted : ExitCode::Ok;
  for (const DetectedCamera& camera : cameras) {
    if (!camera.end) {
      code = console.failed(camera.end.error(), ExitCode::SomeFailed);
      continue;
    }
    const CameraCounts& counts = camera.end->counts;
    console.say(fmt::format(
        "{}{} in {:.1f} s, {}; {} dropped for newer ones, {} lost by the driver, "
        "{} damaged",
        cameras.size() > 1 ? camera.address + ": " : "", counted(camera.end->pictures, "picture"),
        camera.end->seconds, counted(camera.end->tags, "tag"), counts.dropped, counts.lost, counts.damaged));
  }
  return code;
}

}  // namespace

Result<bool> is_camera_input(const CLI::App& app, const std::vector<std::string>& sources) {
  const bool live = !sources.empty() && std::ranges::all_of(sources, is_camera_address);
  if (!live && std::ranges::any_of(sources, is_camera_address))
    return fail(ErrorCode::InvalidArgument, "live cameras and files are named together", {},
                "Run the program once for the files, and once for the cameras.");
  Status status = live ? check_several(app, sources) : Status();
  for (const char* flag : {"--view", "--duration-s"})
    if (status && !live) status = refuse_flag(app, flag, "this is about live cameras", "Leave it out.");
  for (const char* flag : {"--annotate", "--recursive"})
    if (status && live)
      status = refuse_flag(app, flag, "this is about files, and the input is a live camera",
                           "Leave it out; `waymark convert` records the camera.");
  if (!status) return tl::unexpected(status.error());
  return live;
}

ExitCode detect_live(DetectCamerasJob job, bool json, bool covariance, const TagFinder& finder,
                     Console& console) {
  job.on_picture = [&](const PictureReport& report, const PoseList& poses, Duration age) {
    const double age_ms = 1e3 * to_seconds(age);
    if (json) {
      nlohmann::ordered_json line = to_json(report, poses, covariance);
      line["age_ms"] = age_ms;
      console.print(json_line(line));
    } else if (!job.page) {
      console.print(waymark::to_text(report) + waymark::to_text(report.detections, poses));
    } else {
      console.live(fmt::format("{} tags, {:.0f} ms old", report.detections.size(), age_ms));
    }
  };
  JobControl control = control_from(console);
  control.cancelled = [&console] { return interrupted() || console.output_ended(); };
  const auto cameras = detect_cameras(job, finder, control);
  if (cameras) return say_ends(*cameras, console);
  const bool usage = cameras.error().code == ErrorCode::InvalidArgument;
  return console.failed(cameras.error(), usage ? ExitCode::Usage : ExitCode::SomeFailed);
}

}  // namespace waymark::cli

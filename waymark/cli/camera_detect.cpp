#include "waymark/cli/camera_detect.hpp"

#include <algorithm>

#include "waymark/cli/parts.hpp"
#include "waymark/jobs/detections_text.hpp"
#include "waymark/live/camera_address.hpp"

namespace waymark::cli {
namespace {

ExitCode say_ends(const std::vector<DetectedCamera>& cameras, Console& console) {
  console.end_progress();
  ExitCode code = interrupted() ? ExitCode::Interrupted : ExitCode::Ok;
  for (const DetectedCamera& camera : cameras) {
    if (camera.end)
      console.say(to_text(camera, cameras.size() > 1));
    else
      code = console.failed(camera.end.error(), ExitCode::SomeFailed);
  }
  return code;
}

}  // namespace

Result<bool> is_camera_input(const CLI::App& app, const std::vector<std::string>& sources) {
  const auto live = are_cameras(sources);
  if (!live) return live;
  Refusals refused(app);
  refused.flags(*live && sources.size() > 1, {"--view", "--camera"},
                "this is about one camera, and several are named", "Run the program once for each camera.");
  refused.flags(!*live, {"--view", "--duration-s"}, "this is about live cameras", "Leave it out.");
  refused.flags(*live, {"--annotate", "--recursive"}, "this is about files, and the input is a live camera",
                "Leave it out; `waymark convert` records the camera.");
  if (!refused.status()) return tl::unexpected(refused.status().error());
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

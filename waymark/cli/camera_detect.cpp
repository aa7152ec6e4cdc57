#include <fmt/format.h>

#include "waymark/cli/camera_detect.hpp"

#include "waymark/cli/parts.hpp"
#include "waymark/jobs/detections_text.hpp"

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

#include "waymark/app/convert/record_camera.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/live/cameras.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {

Result<RecordCameraReport> record_camera(const ConvertVideoJob& job, double duration_s,
                                         const TagFinder& finder, const JobControl& control) {
  const auto camera = open_live_camera(job.input);
  if (!camera) return tl::unexpected(camera.error());
  CameraWatch watch{.camera = job.camera ? &*job.camera : nullptr,
                    .on_picture = {},
                    .on_words = control.note,
                    .should_stop = control.cancelled};
  if (duration_s > 0) watch.duration_s = duration_s;
  Result<CameraWatchEnd> end = CameraWatchEnd();
  const Status written = record_tags(job, "camera", [&](const TakeTagPicture& take) -> Status {
    watch.on_picture = [&](CameraPicture& seen) {
      control.progress({fmt::format("{} tags", seen.found.detections.size())});
      return take(seen.frame.image, TagFrame{seen.frame.stamp, seen.frame.camera, seen.found.detections});
    };
    end = watch_camera(**camera, finder, watch);
    return end ? Status() : tl::unexpected(end.error());
  });
  if (!written) return tl::unexpected(written.error());
  return RecordCameraReport{.description = (*camera)->description(), .end = *end};
}

std::string to_text(const ConvertVideoJob& job, const RecordCameraReport& report) {
  return fmt::format("{} ({}) to {}: {} in {:.1f} s, {}\n", job.input, report.description, job.output,
                     counted(report.end.pictures, "picture"), report.end.seconds,
                     counted(report.end.tags, "tag"));
}

nlohmann::ordered_json to_json(const ConvertVideoJob& job, const RecordCameraReport& report) {
  const CameraCounts& counts = report.end.counts;
  return {{"input", job.input},
          {"input_format", "camera"},
          {"output", job.output},
          {"output_format", "mcap"},
          {"pictures", report.end.pictures},
          {"tags", report.end.tags},
          {"seconds", report.end.seconds},
          {"dropped", counts.dropped},
          {"lost", counts.lost},
          {"damaged", counts.damaged}};
}

}  // namespace waymark

#include "waymark/app/convert/record_camera.hpp"

#include <fmt/format.h>

#include "waymark/app/live/cameras.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {

Result<RecordCameraReport> record_camera(const ConvertVideoJob& job, double duration_s,
                                         const TagFinder& finder, const JobControl& control) {
  const auto camera = open_live_camera(job.input);
  if (!camera) return tl::unexpected(camera.error());
  CameraWatch watch{.lens = job.camera ? ImageLens::of(*job.camera) : ImageLens::unknown(),
                    .on_image = {},
                    .on_message = control.note,
                    .should_stop = control.cancelled};
  if (duration_s > 0) watch.duration_s = duration_s;
  Result<CameraWatchEnd> end = CameraWatchEnd();
  const Status written = record_tags(job, "camera", [&](const TakeTagImage& take) -> Status {
    watch.on_image = [&](CameraImage& seen) {
      control.progress({fmt::format("{} tags", seen.found.detections.size())});
      return take(seen.frame.image, TagFrame{seen.frame.stamp, seen.frame.camera, seen.found.detections});
    };
    end = watch_camera(**camera, finder, watch);
    return end ? Status() : tl::unexpected(end.error());
  });
  if (!written) return tl::unexpected(written.error());
  if (const std::string note = no_tags_note(*end, finder); !note.empty()) control.note(note);
  return RecordCameraReport{
      .input = job.input, .output = job.output, .description = (*camera)->description(), .end = *end};
}

std::string to_text(const RecordCameraReport& report) {
  return fmt::format("{} ({}) to {}: {} in {:.1f} s, {}\n", report.input, report.description, report.output,
                     counted(report.end.images, "image"), report.end.seconds,
                     counted(report.end.tags, "tag"));
}

ReportFields fields(const RecordCameraReport& report) {
  const CameraCounts& counts = report.end.counts;
  return {
      {"input", "Address of the camera", report.input},
      {"input_format", "camera", "camera"},
      {"output", "Recording that was written", report.output},
      {"output_format", "mcap", "mcap"},
      {"images", "Videos and cameras: number of images searched for tags", report.end.images},
      {"tags", "Videos and cameras: number of detections in all images", report.end.tags},
      {"unreliable_tags", "Videos and cameras: number of these tags with unreliable corners",
       report.end.unreliable},
      {"seconds", "Cameras: time from the first image to the last [s]", report.end.seconds},
      {"dropped", "Cameras: number of images replaced by newer ones before they were read", counts.dropped},
      {"lost", "Cameras: number of images missing from the driver's sequence numbers", counts.lost},
      {"damaged", "Cameras: number of images that were incomplete or could not be decoded", counts.damaged}};
}

}  // namespace waymark

#include <fmt/format.h>

#include "waymark/app/common/detect_all.hpp"
#include "waymark/media/video_reader.hpp"

namespace waymark {
namespace {

/// Missing pictures are failures; what only has to be known is said.
void report_problems(const std::string& path, const VideoReader& reader, const JobControl& control,
                     DetectSummary& summary) {
  for (const VideoProblem& problem : reader.problems()) {
    if (problem.key == "video.damaged" || problem.key == "video.truncated")
      internal::fail_with(problem.error, path, control, summary);
    else
      control.note(to_string(problem.error));
  }
}

}  // namespace

bool detect_video(std::size_t index, const std::string& path, const TagFinder& finder,
                  const CameraModel* camera, const JobControl& control, const EachPicture& each,
                  DetectSummary& summary) {
  Result<VideoReader> reader = VideoReader::open(path);
  if (!reader) {
    PictureReport report{.image = path, .error = reader.error()};
    internal::fail_with(reader.error(), path, control, summary);
    return each(index, report, {});
  }
  bool going = true;
  while (going) {
    const Result<std::optional<VideoFrame>> frame = reader->next();
    if (!frame) internal::fail_with(frame.error(), path, control, summary);
    if (!frame || !*frame) break;
    PictureReport report = internal::report_on(path, (*frame)->stamp, (*frame)->luma, finder, camera);
    going = each(index, report, (*frame)->luma);
    internal::count(report, control, summary);
    control.progress({fmt::format("{} {:.0f} %, {} tags", report.image, 100 * reader->progress(),
                                  report.detections.size())});
    summary.stopped = control.cancelled();
    going = going && !summary.stopped;
  }
  if (summary.stopped) control.note(fmt::format("stopped within {}", path));
  report_problems(path, *reader, control, summary);
  return going;
}

}  // namespace waymark

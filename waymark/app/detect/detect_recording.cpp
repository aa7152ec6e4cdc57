#include <fmt/format.h>

#include "waymark/app/common/detect_all.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros2_messages.hpp"

namespace waymark {
namespace {

LogSelection pictures_of(const MessageLog& log) {
  LogSelection selection;
  for (const LogChannel& channel : log.channels()) {
    if (channel.type == ros2::Image::kType || channel.type == ros2::CompressedImage::kType)
      selection.topics.insert(channel.topic);
  }
  return selection;
}

}  // namespace

bool detect_recording(std::size_t index, const std::string& path, const TagFinder& finder,
                      const CameraModel* camera, const JobControl& control, const EachPicture& each,
                      DetectSummary& summary) {
  const Result<std::unique_ptr<MessageLog>> log = open_log(path, control.log_options());
  if (!log) {
    internal::fail_with(log.error(), path, control, summary);
    return true;
  }
  const LogSelection pictures = pictures_of(**log);
  if (pictures.topics.empty()) {
    internal::fail_with({ErrorCode::NotFound,
                         "this recording holds no pictures",
                         {.source = path},
                         "`waymark info` shows what it holds."},
                        path, control, summary);
    return true;
  }
  bool going = true;
  const Status status = (*log)->visit_samples(pictures, [&](const Sample& sample) -> Status {
    const auto* frame = std::get_if<CameraFrame>(&sample);
    if (frame == nullptr) return {};
    PictureReport report = internal::report_on(path, frame->stamp, frame->image, finder, camera);
    going = each(index, report, frame->image);
    internal::count(report, control, summary);
    control.progress({fmt::format("{}, {} tags", report.image, report.detections.size())});
    summary.stopped = control.cancelled();
    going = going && !summary.stopped;
    return going ? Status{} : fail(ErrorCode::LimitExceeded, "stopped");
  });
  if (summary.stopped) control.note(fmt::format("stopped within {}", path));
  if (!status && going) internal::fail_with(status.error(), path, control, summary);
  for (const LogProblem& problem : (*log)->problems())
    if (problem.kind == LogProblem::Kind::Damage) internal::fail_with(problem.error, path, control, summary);
  return going;
}

}  // namespace waymark

#include "waymark/app/detect/annotated_video.hpp"

#include <cmath>
#include <system_error>

#include "waymark/media/video_format.hpp"
#include "waymark/media/video_reader.hpp"

namespace waymark {

Result<AnnotatedVideo> AnnotatedVideo::create(const std::string& path, const std::vector<Input>& inputs) {
  AnnotatedVideo video;
  video.path_ = path;
  bool known = false;
  for (const Input& input : inputs) {
    std::error_code ignored;
    if (std::filesystem::equivalent(input.path, path, ignored))
      return fail(ErrorCode::InvalidArgument, "this is a video that is read", {.source = path},
                  "Give --annotate another name.");
    if (known || input.error || !looks_like_video(input.path)) continue;
    const Result<VideoReader> reader = VideoReader::open(input.path);
    if (!reader) continue;  // said when it is read
    video.options_.rate_hz = reader->info().mean_rate_hz.value_or(video.options_.rate_hz);
    video.options_.rotation_deg = reader->info().rotation_deg;
    known = true;
  }
  return video;
}

Status AnnotatedVideo::add(const ColorImage& picture, std::optional<SensorTime> stamp) {
  if (!writer_) {
    Result<VideoWriter> made = VideoWriter::create(path_, picture.width(), picture.height(), options_);
    if (!made) return tl::unexpected(made.error());
    writer_ = std::move(*made);
  }
  const Duration step(std::llround(1e9 / options_.rate_hz));
  SensorTime shown = stamp ? *stamp + shift_ : last_ ? *last_ + step : SensorTime();
  if (last_ && shown <= *last_) {
    shift_ += *last_ + step - shown;
    shown = *last_ + step;
  }
  last_ = shown;
  return writer_->add(picture, shown);
}

Status AnnotatedVideo::close() { return writer_ ? writer_->close() : Status(); }

}  // namespace waymark

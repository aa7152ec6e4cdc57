#include <fmt/format.h>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/convert_video.hpp"
#include "waymark/app/common/poses.hpp"

namespace waymark {

Result<VideoTags> find_video_tags(const std::string& path, const TagFinder& finder, const CameraModel* camera,
                                  const JobControl& control, const EachVideoTags& each) {
  Result<VideoReader> reader = VideoReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  VideoTags all{.info = reader->info()};
  TagSequence sequence(finder);
  while (true) {
    if (control.cancelled())
      return fail(ErrorCode::Unwritable, "stopped before its tags were found", {.source = path});
    const Result<std::optional<VideoFrame>> frame = reader->next();
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) break;
    const VideoFrame& picture = **frame;
    Status fits =
        camera == nullptr ? Status() : check_picture_size(*camera, picture.luma.width, picture.luma.height);
    if (!fits) {
      fits.error().place.source = path;
      return tl::unexpected(fits.error());
    }
    Result<FoundTags> found = sequence.find(picture.luma, camera);
    if (!found) return tl::unexpected(found.error());
    ++all.pictures;
    all.tags += found->detections.size();
    TagFrame tags{.stamp = picture.stamp, .detections = std::move(found->detections)};
    const std::string words =
        fmt::format("finding tags: {:.0f} %, {} in the picture at {:.1f} s", 100 * reader->progress(),
                    tags.detections.size(), to_seconds(picture.stamp.time_since_epoch()));
    if (Status taken = each(picture, tags); !taken) return tl::unexpected(taken.error());
    control.progress({words});
  }
  all.problems = reader->problems();
  if (all.pictures == 0)
    return fail(ErrorCode::Unreadable, "no picture of this video is whole", {.source = path});
  return all;
}

}  // namespace waymark

#include "waymark/app/common/camera_tags.hpp"

#include <filesystem>

#include <fmt/format.h>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/base/counted.hpp"
#include "waymark/media/video_format.hpp"
#include "waymark/recording/log_report.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {
namespace {

/// The tags of one sample, if it is a picture or its tags.
class SampleTags {
 public:
  SampleTags(const std::string& path, const TagFinder& finder, const CameraModel& camera, bool has_tags)
      : path_(path), sequence_(finder), camera_(camera), has_tags_(has_tags) {}

  Result<std::optional<TagFrame>> of(const Sample& sample) {
    if (const auto* tags = std::get_if<TagFrame>(&sample); tags != nullptr && has_tags_) {
      if (Status same = check_name(tags->camera); !same) return tl::unexpected(same.error());
      return *tags;
    }
    const auto* picture = std::get_if<CameraFrame>(&sample);
    if (picture == nullptr || has_tags_) return std::nullopt;
    Status fits = check_name(picture->camera);
    if (fits) fits = check_picture_size(camera_, picture->image.width(), picture->image.height());
    if (!fits) return tl::unexpected(fits.error());
    Result<FoundTags> found = sequence_.find(picture->image.view(), &camera_);
    if (!found) return tl::unexpected(found.error());
    return TagFrame{picture->stamp, picture->camera, std::move(found->detections)};
  }

 private:
  Status check_name(const std::string& name) {
    if (!name_) name_ = name;
    if (*name_ == name) return {};
    return fail(ErrorCode::InvalidArgument,
                fmt::format("it holds pictures of several cameras: '{}' and '{}'", *name_, name),
                {.source = path_}, "Record each camera by itself.");
  }

  const std::string& path_;
  TagSequence sequence_;
  const CameraModel& camera_;
  bool has_tags_;
  std::optional<std::string> name_{};
};

Result<VideoTags> find_recorded_tags(const std::string& path, const TagFinder& finder,
                                     const CameraModel& camera, const JobControl& control,
                                     const EachTagFrame& each) {
  const auto log = open_log(path, control.log_options());
  if (!log) return tl::unexpected(log.error());
  const Result<LogContents> contents = contents_of(**log);
  if (!contents) return tl::unexpected(contents.error());
  SampleTags tags_of(path, finder, camera, contents->contains("tags"));
  VideoTags all;
  const Status status = (*log)->visit_samples({}, [&](const Sample& sample) -> Status {
    if (control.cancelled())
      return fail(ErrorCode::Unwritable, "stopped before its tags were found", {.source = path});
    auto tags = tags_of.of(sample);
    if (!tags) return tl::unexpected(tags.error());
    if (!*tags) return {};
    ++all.pictures;
    all.tags += (*tags)->detections.size();
    control.progress({fmt::format("finding tags: {}", counted(all.pictures, "picture"))});
    return each(**tags);
  });
  if (!status) return tl::unexpected(status.error());
  for (const LogProblem& problem : (*log)->problems()) control.note(to_string(problem.error));
  if (all.pictures == 0)
    return fail(ErrorCode::Unreadable, "no picture of this recording is whole", {.source = path});
  return all;
}

}  // namespace

bool is_of_camera(const std::string& path, bool calibrated) {
  if (looks_like_video(path)) return true;
  if (!calibrated) return false;
  const auto log = open_log(path);
  const auto contents = log ? contents_of(**log) : tl::unexpected(log.error());
  if (!contents || contents->empty()) return true;  // who reads it says what is wrong
  const auto has = [&](const char* what) { return contents->contains(what); };
  return (has("tags") || has("pictures")) && !has("odometry") && !has("imu");
}

Result<VideoTags> find_camera_tags(const std::string& path, const TagFinder& finder,
                                   const CameraModel& camera, const JobControl& control,
                                   const EachTagFrame& each) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !looks_like_video(path))
    return find_recorded_tags(path, finder, camera, control, each);
  return find_video_tags(path, finder, &camera, control,
                         [&](const VideoFrame&, TagFrame& tags) { return each(tags); });
}

}  // namespace waymark

#include "waymark/app/common/camera_tags.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>

#include <unistd.h>

#include <fmt/format.h>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/detect_all.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/media/video_format.hpp"
#include "waymark/recording/log_report.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/tags/no_tags.hpp"

namespace waymark {

Result<VideoTags> find_video_tags(const std::string& path, const TagFinder& finder, ImageLens lens,
                                  const JobControl& control, const EachVideoTags& each) {
  Result<VideoReader> reader = or_wrong_kind(VideoReader::open(path), path, FileUse::Video);
  if (!reader) return tl::unexpected(reader.error());
  VideoTags all{.info = reader->info()};
  TagSequence sequence(finder);
  NoTagDiagnosis no_tags;
  while (true) {
    if (control.cancelled())
      return fail(ErrorCode::Unwritable, "stopped before its tags were found", {.source = path});
    const Result<std::optional<VideoFrame>> frame = reader->next();
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) break;
    const VideoFrame& image = **frame;
    Status fits =
        !lens.known() ? Status() : check_image_size(*lens.camera(), image.luma.width, image.luma.height);
    if (!fits) {
      fits.error().place.source = path;
      return tl::unexpected(fits.error());
    }
    Result<FoundTags> found = sequence.find(image.luma, lens);
    if (!found) return tl::unexpected(found.error());
    ++all.images;
    all.tags += found->detections.size();
    all.unreliable += count_unreliable(found->detections);
    no_tags.add(image.luma, found->detections.size() + found->beyond_lens);
    TagFrame tags{.stamp = image.stamp, .detections = std::move(found->detections)};
    const std::string words =
        fmt::format("finding tags: {:.0f} %, {} in the image at {:.1f} s", 100 * reader->progress(),
                    tags.detections.size(), to_seconds(image.stamp.time_since_epoch()));
    if (Status taken = each(image, tags); !taken) return tl::unexpected(taken.error());
    control.progress({words});
  }
  all.problems = reader->problems();
  if (all.images == 0)
    return fail(ErrorCode::Unreadable, "this video contains no intact image", {.source = path});
  if (const auto reason = no_tags.reason(finder.tracking.detector)) control.note("note: " + reason->message);
  if (all.unreliable > 0) control.note("note: " + unreliable_note(all.unreliable));
  return all;
}

namespace {

Image owned_copy(const ImageView& view) {
  Image image(view.width, view.height);
  for (int y = 0; y < view.height; ++y) std::copy_n(view.row(y), view.width, image.row(y));
  return image;
}

Status check_job(const ConvertVideoJob& job) {
  std::error_code ignored;
  if (std::filesystem::path(job.output).extension() != ".mcap")
    return fail(ErrorCode::InvalidArgument, "the output of a video must be an MCAP recording",
                {.source = job.output, .key = "`output`"},
                "End the name in .mcap; `waymark detect json=true` writes the tags as text.");
  if (std::filesystem::exists(job.output, ignored))
    return fail(ErrorCode::Unwritable, "this file already exists", {.source = job.output},
                "Recordings are never overwritten: choose another name or remove the file.");
  return {};
}

Status begin(const ConvertVideoJob& job, const std::string& format, SampleRecorder& recorder) {
  std::map<std::string, std::string> facts = {
      {"verb", "convert"},
      {"version", WAYMARK_VERSION},
      {"source", std::filesystem::path(job.input).filename().string()},
      {"source_format", format}};
  add_tag_sizes(job.sizes, facts);
  if (job.camera)
    recorder.add_cameras_with_first_sample({{.camera = *job.camera, .base_T_cam = base_T_camera({})}});
  return recorder.add_metadata(lap_facts::kMetadata, facts);
}

Status write_tags(const ConvertVideoJob& job, const std::string& format, const std::filesystem::path& to,
                  const std::function<Status(const TakeTagImage&)>& all) {
  auto file = create_file(to);
  if (!file) return tl::unexpected(file.error());
  auto recorder = SampleRecorder::open(std::move(*file), {.library = "waymark " WAYMARK_VERSION});
  Status status = recorder ? begin(job, format, *recorder) : tl::unexpected(recorder.error());
  if (!status) return status;
  status = all([&](const ImageView& image, const TagFrame& tags) -> Status {
    if (!job.images.empty()) {
      const CameraFrame kept{.stamp = tags.stamp, .image = owned_copy(image)};
      if (Status added = record_image(kept, job.images, *recorder); !added) return added;
    }
    return recorder->add(tags);
  });
  return status ? recorder->close() : status;
}

}  // namespace

Status record_tags(const ConvertVideoJob& job, const std::string& format,
                   const std::function<Status(const TakeTagImage&)>& all) {
  if (Status sound = check_job(job); !sound) return sound;
  const std::filesystem::path beside = fmt::format("{}.{}.part", job.output, ::getpid());
  Status written = write_tags(job, format, beside, all);
  std::error_code error;
  if (written) std::filesystem::rename(beside, job.output, error);
  if (written && !error) return written;
  std::error_code ignored;
  std::filesystem::remove(beside, ignored);
  if (error) return fail(ErrorCode::Unwritable, error.message(), {.source = job.output});
  if (written.error().place.source == beside.string())
    written.error() = named_output(std::move(written.error()), job.output);
  return written;
}

Result<VideoTags> convert_video(const ConvertVideoJob& job, const TagFinder& finder,
                                const JobControl& control) {
  const ImageLens lens = job.camera ? ImageLens::of(*job.camera) : ImageLens::unknown();
  Result<VideoTags> found = VideoTags();
  const Status written = record_tags(job, "video", [&](const TakeTagImage& take) -> Status {
    found = find_video_tags(job.input, finder, lens, control,
                            [&](const VideoFrame& image, TagFrame& tags) { return take(image.luma, tags); });
    return found ? Status() : tl::unexpected(found.error());
  });
  if (!written) return tl::unexpected(written.error());
  return found;
}

std::string to_text(const ConvertVideoJob& job, const VideoTags& found) {
  return fmt::format("{} ({}, {} x {} px) to {}: {}, {}\n", job.input, found.info.codec, found.info.width_px,
                     found.info.height_px, job.output, counted(found.images, "image"),
                     counted(found.tags, "tag"));
}

namespace {

struct ListedProblem {
  VideoProblem problem{};
};

ReportFields fields(const ListedProblem& listed) {
  return {
      {"key", "Stable name of the problem", listed.problem.key},
      {"count", "Number of occurrences", listed.problem.count},
      {"message", "Error message, with the place of the first occurrence", to_string(listed.problem.error)}};
}

}  // namespace

ReportFields fields(const ConvertedVideo& converted) {
  const VideoTags& found = converted.found;
  const std::vector<ListedProblem> problems(found.problems.begin(), found.problems.end());
  return {{"input", "Video that was read", converted.input},
          {"input_format", "video", "video"},
          {"codec", "Videos: codec, such as h264", found.info.codec},
          {"output", "Recording that was written", converted.output},
          {"output_format", "mcap", "mcap"},
          {"images", "Videos and cameras: images that were searched for tags", found.images},
          {"tags", "Videos and cameras: detections in all images", found.tags},
          {"unreliable_tags", "Videos and cameras: number of these tags with unreliable corners",
           found.unreliable},
          {"problems", "Defects of the video", problems}};
}

namespace {

/// The tags in a sample that is an image or already contains tags.
class SampleTags {
 public:
  SampleTags(const std::string& path, const TagFinder& finder, const CameraModel& camera, bool has_tags)
      : path_(path), sequence_(finder), camera_(camera), has_tags_(has_tags) {}

  Result<std::optional<TagFrame>> of(const Sample& sample) {
    if (const auto* tags = std::get_if<TagFrame>(&sample); tags != nullptr && has_tags_) {
      if (Status same = check_name(tags->camera); !same) return tl::unexpected(same.error());
      return *tags;
    }
    const auto* frame = std::get_if<CameraFrame>(&sample);
    if (frame == nullptr || has_tags_) return std::nullopt;
    Status fits = check_name(frame->camera);
    if (fits) fits = check_image_size(camera_, frame->image.width(), frame->image.height());
    if (!fits) return tl::unexpected(fits.error());
    Result<FoundTags> found = sequence_.find(frame->image.view(), ImageLens::of(camera_));
    if (!found) return tl::unexpected(found.error());
    no_tags_.add(frame->image, found->detections.size() + found->beyond_lens);
    return TagFrame{frame->stamp, frame->camera, std::move(found->detections)};
  }
  [[nodiscard]] const NoTagDiagnosis& no_tags() const { return no_tags_; }

 private:
  Status check_name(const std::string& name) {
    if (!name_) name_ = name;
    if (*name_ == name) return {};
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the recording contains images of several cameras: '{}' and '{}'", *name_, name),
                {.source = path_}, "Record each camera separately.");
  }

  const std::string& path_;
  TagSequence sequence_;
  const CameraModel& camera_;
  bool has_tags_;
  std::optional<std::string> name_{};
  NoTagDiagnosis no_tags_{};
};

Result<VideoTags> find_recorded_tags(const std::string& path, const TagFinder& finder,
                                     const CameraModel& camera, const JobControl& control,
                                     const EachTagFrame& each) {
  const auto log = or_wrong_kind(open_log(path, control.log_options()), path, FileUse::Video);
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
    ++all.images;
    all.tags += (*tags)->detections.size();
    all.unreliable += count_unreliable((*tags)->detections);
    control.progress({fmt::format("finding tags: {}", counted(all.images, "image"))});
    return each(**tags);
  });
  if (!status) return tl::unexpected(status.error());
  for (const LogProblem& problem : (*log)->problems()) control.note(to_string(problem.error));
  if (all.images == 0)
    return fail(ErrorCode::Unreadable, "this recording contains no intact image", {.source = path});
  if (all.unreliable > 0) control.note("note: " + unreliable_note(all.unreliable));
  if (const auto reason = tags_of.no_tags().reason(finder.tracking.detector))
    control.note("note: " + reason->message);
  return all;
}

}  // namespace

bool is_of_camera(const std::string& path, bool calibrated) {
  if (kind_of(path) == FileKind::Video) return true;
  if (!calibrated) return false;
  const auto log = open_log(path);
  const auto contents = log ? contents_of(**log) : tl::unexpected(log.error());
  if (!contents || contents->empty()) return true;  // its reader will report the error
  const auto has = [&](const char* what) { return contents->contains(what); };
  return (has("tags") || has("images")) && !has("odometry") && !has("imu");
}

Status check_of_camera(const std::string& path, const std::string& hint) {
  if (is_of_camera(path, true)) return {};
  return fail(ErrorCode::InvalidArgument, "this recording contains odometry or an IMU, so it is a robot's",
              {.key = path}, hint);
}

Result<VideoTags> find_camera_tags(const std::string& path, const TagFinder& finder,
                                   const CameraModel& camera, const JobControl& control,
                                   const EachTagFrame& each) {
  if (kind_of(path) != FileKind::Video) return find_recorded_tags(path, finder, camera, control, each);
  return find_video_tags(path, finder, ImageLens::of(camera), control,
                         [&](const VideoFrame&, TagFrame& tags) { return each(tags); });
}

}  // namespace waymark

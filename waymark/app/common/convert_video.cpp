#include "waymark/app/common/convert_video.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>

#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/base/counted.hpp"
#include "waymark/recording/picture_recording.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/samples/camera_body.hpp"

namespace waymark {
namespace {

Image copy_of(const ImageView& view) {
  Image image(view.width, view.height);
  for (int y = 0; y < view.height; ++y) std::copy_n(view.row(y), view.width, image.row(y));
  return image;
}

Status check_job(const ConvertVideoJob& job) {
  std::error_code ignored;
  if (std::filesystem::path(job.output).extension() != ".mcap")
    return fail(ErrorCode::InvalidArgument, "a video becomes a recording of its tags", {.source = job.output},
                "End the name in .mcap; `waymark detect --json` writes the tags as text.");
  if (std::filesystem::exists(job.output, ignored))
    return fail(ErrorCode::Unwritable, "this file exists already", {.source = job.output},
                "A recording is never overwritten: choose another name or remove it.");
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
                  const std::function<Status(const TakeTagPicture&)>& all) {
  auto file = create_file(to);
  if (!file) return tl::unexpected(file.error());
  auto recorder = SampleRecorder::open(std::move(*file), {.library = "waymark " WAYMARK_VERSION});
  Status status = recorder ? begin(job, format, *recorder) : tl::unexpected(recorder.error());
  if (!status) return status;
  status = all([&](const ImageView& picture, const TagFrame& tags) -> Status {
    if (!job.pictures.empty()) {
      const CameraFrame kept{.stamp = tags.stamp, .image = copy_of(picture)};
      if (Status added = record_picture(kept, job.pictures, *recorder); !added) return added;
    }
    return recorder->add(tags);
  });
  return status ? recorder->close() : status;
}

}  // namespace

Status record_tags(const ConvertVideoJob& job, const std::string& format,
                   const std::function<Status(const TakeTagPicture&)>& all) {
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
  const CameraModel* camera = job.camera ? &*job.camera : nullptr;
  Result<VideoTags> found = VideoTags();
  const Status written = record_tags(job, "video", [&](const TakeTagPicture& take) -> Status {
    found =
        find_video_tags(job.input, finder, camera, control,
                        [&](const VideoFrame& picture, TagFrame& tags) { return take(picture.luma, tags); });
    return found ? Status() : tl::unexpected(found.error());
  });
  if (!written) return tl::unexpected(written.error());
  return found;
}

std::string to_text(const ConvertVideoJob& job, const VideoTags& found) {
  return fmt::format("{} ({}, {} x {} px) to {}: {}, {}\n", job.input, found.info.codec, found.info.width_px,
                     found.info.height_px, job.output, counted(found.pictures, "picture"),
                     counted(found.tags, "tag"));
}

nlohmann::ordered_json to_json(const ConvertVideoJob& job, const VideoTags& found) {
  nlohmann::ordered_json problems = nlohmann::ordered_json::array();
  for (const VideoProblem& problem : found.problems)
    problems.push_back({{"key", problem.key}, {"count", problem.count}, {"words", to_string(problem.error)}});
  return {{"input", job.input},   {"input_format", "video"},        {"codec", found.info.codec},
          {"output", job.output}, {"output_format", "mcap"},        {"pictures", found.pictures},
          {"tags", found.tags},   {"problems", std::move(problems)}};
}

}  // namespace waymark

#include "waymark/app/localize/localize_video.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/localize/localize_output.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/landmarks_file.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

Status write(const LocalizeVideoJob& job, const CameraModel& camera, const std::vector<TagFrame>& frames,
             const std::vector<CameraMoment>& moments) {
  Result<LocalizeOutput> output =
      LocalizeOutput::open(job.output, {},
                           {.name = std::filesystem::path(job.video).filename().string(),
                            .map = job.map,
                            .live = true,
                            .cameras = {{.camera = camera, .base_T_cam = base_T_camera({})}}});
  if (!output) return tl::unexpected(output.error());
  Status status;
  for (std::size_t i = 0; i < frames.size() && status; ++i) {
    status = output->on_sample(frames[i]);
    if (status && moments[i].map_T_body) status = output->on_pose(moments[i].stamp, pose_message(moments[i]));
  }
  const auto closed = output->close(!status);
  if (status && closed) return {};
  std::error_code ignored;  // otherwise, a part of the video could be mistaken for all of it
  if (std::filesystem::is_regular_file(job.output, ignored)) std::filesystem::remove(job.output, ignored);
  return status ? tl::unexpected(closed.error()) : status;
}

}  // namespace

Result<LocalizeVideoReport> localize_video(const LocalizeVideoJob& job, const JobControl& control) {
  if (Status camera = check_of_camera(job.video, "Use `waymark localize log`."); !camera)
    return tl::unexpected(camera.error());
  const Result<DescribedCamera> described = read_given_camera(job.camera);
  if (!described) return tl::unexpected(described.error());
  const CameraModel& camera = described->camera;
  if (Status valid = check_localize_output(job.output); !valid) return tl::unexpected(valid.error());
  const auto map = or_wrong_kind(read_landmarks(job.map, job.tag_size_m), job.map, FileUse::Map);
  if (!map) return tl::unexpected(map.error());
  if (Status poses = check_tag_poses(map->tags, job.map); !poses) return tl::unexpected(poses.error());
  for (const std::string& note : map->notes) control.note("note: " + note);
  const Result<TagFinder> finder = tag_finder_for(map->tags);
  if (!finder) return tl::unexpected(finder.error());
  std::vector<TagFrame> frames;
  Result<VideoTags> tags =
      find_camera_tags(job.video, *finder, camera, control, [&](TagFrame& frame) -> Status {
        frames.push_back(std::move(frame));
        return {};
      });
  if (!tags) return tl::unexpected(tags.error());
  const auto [moments, corner_error_px] = camera_moments(frames, map->tags, camera, described->readout_s);
  if (Status written = write(job, camera, frames, moments); !written) return tl::unexpected(written.error());
  for (const CameraMoment& moment : moments) job.on_moment(moment);
  const auto known = std::ranges::count_if(
      moments, [](const CameraMoment& moment) { return moment.map_T_body.has_value(); });
  return LocalizeVideoReport{.video = std::move(*tags),
                             .known = static_cast<std::size_t>(known),
                             .corner_error_px = corner_error_px};
}

std::string to_text(const LocalizeVideoReport& report) {
  return fmt::format("{}, {} with a pose", counted(report.video.images, "image"), report.known);
}

}  // namespace waymark

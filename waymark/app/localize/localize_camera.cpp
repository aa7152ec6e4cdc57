#include "waymark/app/localize/localize_camera.hpp"

#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/localize/localize_output.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/landmarks_file.hpp"
#include "waymark/recording/ros2/map_markers.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/server/live_feed.hpp"

namespace waymark {
namespace {

/// Localises camera images, displays the results, and records them.
class CameraLog {
 public:
  CameraLog(const LocalizeCameraJob& job, const CameraModel& model, const TagMap& map, LocalizeOutput& output)
      : job_(job), moments_(map, model), output_(output), fresh_(job.output) {
    if (job.feed == nullptr) return;
    job.feed->show_camera(model, base_T_camera({}));
    job.feed->show_shapes(map_markers(map, {}));
  }

  Status take(CameraImage& seen) {
    const TagFrame tags{seen.frame.stamp, seen.frame.camera, std::move(seen.found.detections)};
    CameraMoment moment = moments_.of(tags);
    moment.age = seen.age;
    fresh_.keep();
    Status status = output_.on_sample(seen.frame);
    if (status) status = output_.on_sample(tags);
    show(seen, tags);
    if (moment.map_T_body) {
      ++known_;
      const auto message = pose_message(moment);
      if (status) status = output_.on_pose(moment.stamp, message);
      if (job_.feed != nullptr) job_.feed->publish(message, host_now_ns());
    }
    job_.on_moment(moment);
    return status;
  }
  [[nodiscard]] std::size_t known() const { return known_; }

 private:
  void show(const CameraImage& seen, const TagFrame& tags) {
    if (job_.feed == nullptr) return;
    job_.feed->set_status({.phase = "localizing"});
    job_.feed->publish(seen.frame, host_now_ns());
    job_.feed->publish(tags, host_now_ns());
  }

  const LocalizeCameraJob& job_;
  LiveMoments moments_;
  LocalizeOutput& output_;
  FreshFile fresh_;
  std::size_t known_ = 0;
};

}  // namespace

Result<CameraModel> read_camera(const LocalizeCameraJob& job) {
  if (Status valid = check_recorded_images(job.images, job.output); !valid)
    return tl::unexpected(valid.error());
  const Result<DescribedCamera> described = read_given_camera(job.camera);
  if (!described) return tl::unexpected(described.error());
  return described->camera;
}

Result<LocalizeCameraReport> localize_camera(LiveCamera& camera, const CameraModel& model,
                                             const LocalizeCameraJob& job, const JobControl& control) {
  const auto map = or_wrong_kind(read_landmarks(job.map, job.tag_size_m), job.map, FileUse::Map);
  if (!map) return tl::unexpected(map.error());
  if (Status poses = check_tag_poses(map->tags, job.map); !poses) return tl::unexpected(poses.error());
  for (const std::string& note : map->notes) control.note("note: " + note);
  const auto finder = tag_finder_for(map->tags);
  if (!finder) return tl::unexpected(finder.error());
  Result<LocalizeOutput> output =
      LocalizeOutput::open(job.output, {},
                           {.name = camera.description(),
                            .map = job.map,
                            .live = true,
                            .images = job.images,
                            .cameras = {{.camera = model, .base_T_cam = base_T_camera({})}}});
  if (!output) return tl::unexpected(output.error());
  CameraLog log(job, model, map->tags, *output);
  CameraWatch watch{.lens = ImageLens::of(model),
                    .on_image = [&](CameraImage& seen) { return log.take(seen); },
                    .on_message = control.note,
                    .should_stop = control.cancelled};
  if (job.duration_s > 0) watch.duration_s = job.duration_s;
  const auto end = watch_camera(camera, *finder, watch);
  const auto closed = output->close(!end);
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  if (const std::string note = no_tags_note(*end, *finder); !note.empty()) control.note(note);
  return LocalizeCameraReport{.end = *end, .known = log.known()};
}

std::string to_text(const LocalizeCameraReport& report) {
  return fmt::format("{} in {:.1f} s, {} with a pose", counted(report.end.images, "image"),
                     report.end.seconds, report.known);
}

}  // namespace waymark

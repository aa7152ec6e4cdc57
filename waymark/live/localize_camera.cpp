#include "waymark/live/localize_camera.hpp"

#include <algorithm>
#include <utility>

#include "waymark/config/landmarks_file.hpp"
#include "waymark/jobs/localize_output.hpp"
#include "waymark/live/fresh_file.hpp"
#include "waymark/live/live_page.hpp"
#include "waymark/pose/multi_tag_pose.hpp"
#include "waymark/recording/map_markers.hpp"
#include "waymark/samples/camera_body.hpp"

namespace waymark {
namespace {

ros2::PoseWithCovarianceStamped message_of(SensorTime stamp, const Uncertain<SE3>& map_T_body) {
  ros2::PoseWithCovarianceStamped message;
  message.header = {.stamp = ros2::to_ros(stamp), .frame_id = std::string(ros2::kMapFrame)};
  message.pose.pose = ros2::to_ros(map_T_body.mean);
  const SE3::Jacobian covariance = coordinate_covariance(map_T_body);
  for (Eigen::Index i = 0; i < 6; ++i)
    for (Eigen::Index j = 0; j < 6; ++j)
      message.pose.covariance[static_cast<std::size_t>(6 * i + j)] = covariance(i, j);
  return message;
}

/// What is shown and recorded of the pictures.
class CameraLog {
 public:
  CameraLog(const LocalizeCameraJob& job, const TagMap& map, LocalizeOutput& output)
      : job_(job), map_(map), output_(output), fresh_(job.localize.output) {
    if (job.feed == nullptr) return;
    job.feed->show_camera(job.camera, base_T_camera({}));
    job.feed->show_shapes(map_markers(map, {}));
  }

  Status take(CameraPicture& seen) {
    const TagFrame tags{seen.frame.stamp, seen.frame.camera, std::move(seen.found.detections)};
    CameraMoment moment = camera_moment(tags, map_, job_.camera);
    moment.age = seen.age;
    fresh_.keep();
    Status status = output_.on_sample(seen.frame);
    if (status) status = output_.on_sample(tags);
    show(seen, tags);
    if (moment.map_T_body) {
      ++known_;
      const auto message = message_of(moment.stamp, *moment.map_T_body);
      if (status) status = output_.on_pose(moment.stamp, message);
      if (job_.feed != nullptr) job_.feed->publish(message, host_now_ns());
    }
    job_.on_moment(moment);
    return status;
  }
  [[nodiscard]] std::size_t known() const { return known_; }

 private:
  void show(const CameraPicture& seen, const TagFrame& tags) {
    if (job_.feed == nullptr) return;
    job_.feed->tell({.phase = "localizing"});
    job_.feed->publish(seen.frame, host_now_ns());
    job_.feed->publish(tags, host_now_ns());
  }

  const LocalizeCameraJob& job_;
  const TagMap& map_;
  LocalizeOutput& output_;
  FreshFile fresh_;
  std::size_t known_ = 0;
};

}  // namespace

CameraMoment camera_moment(const TagFrame& frame, const TagMap& map, const CameraModel& camera) {
  CameraMoment moment{.stamp = frame.stamp, .tags = static_cast<int>(frame.detections.size())};
  const auto pose = estimate_camera_pose(frame.detections, map, camera);
  if (!pose || !pose->usable()) return moment;
  const CameraPoseEstimate& best = pose->estimates.front();
  moment.tags = static_cast<int>(best.detections.size());
  // A turn from the right leaves an error of the parent's side as it is.
  const SE3 cam_T_body(body_R_optical().inverse(), Eigen::Vector3d::Zero());
  moment.map_T_body = Uncertain<SE3>{best.map_T_cam * cam_T_body, best.covariance};
  return moment;
}

Result<LocalizeCameraReport> localize_camera(LiveCamera& camera, const LocalizeCameraJob& job,
                                             const JobControl& control) {
  const Result<LandmarksFile> map = read_landmarks(job.localize.map, job.localize.tag_size_m);
  if (!map) return tl::unexpected(map.error());
  if (map->tags.tags.empty())
    return fail(ErrorCode::InvalidArgument,
                "a camera needs a map with poses of tags, and this one has points only",
                {.source = job.localize.map}, "Give a map that `waymark map` made.");
  const auto finder = make_tag_finder();
  if (!finder) return tl::unexpected(finder.error());
  Result<LocalizeOutput> output =
      LocalizeOutput::open(job.localize, {},
                           {.name = camera.description(),
                            .live = true,
                            .images = job.images,
                            .cameras = {{.camera = job.camera, .base_T_cam = base_T_camera({})}}});
  if (!output) return tl::unexpected(output.error());
  CameraLog log(job, map->tags, *output);
  CameraWatch watch{.camera = &job.camera,
                    .on_picture = [&](CameraPicture& seen) { return log.take(seen); },
                    .on_words = control.note,
                    .should_stop = control.cancelled};
  if (job.duration_s > 0) watch.duration_s = job.duration_s;
  const auto end = watch_camera(camera, *finder, watch);
  const auto closed = output->close(!end);
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  return LocalizeCameraReport{.end = *end, .known = log.known()};
}

}  // namespace waymark

#include "waymark/cli/lesson.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/cli/picture_recording.hpp"

namespace waymark::cli {
namespace {

/// Truth of pictures, where no estimator looks.
constexpr const char* kTruthTags = "/truth/tag_detections";

/// The corners that are wholly in view, as if a detector without errors had found them.
TagFrame true_corners(const SeenPicture& seen) {
  TagFrame frame{.stamp = seen.found.stamp};
  for (const SceneTagTruth& tag : seen.picture.tags) {
    if (std::ranges::count(tag.corner_visible, true) < 4) continue;
    frame.detections.push_back({.tag = tag.tag, .hamming = 0, .corners_px = tag.corners_px});
  }
  return frame;
}

}  // namespace

TeachMonitorOptions monitor_options(const SimulatedStage& stage) {
  TeachMonitorOptions options;
  if (stage.pictures) options.exposure_ms = stage.pictures->camera.exposure_ms;
  // Pixels a radian in the middle of the picture, whatever the model.
  const auto ahead = stage.camera.project(Eigen::Vector3d(0, 0, 1));
  const auto beside = stage.camera.project(Eigen::Vector3d(1e-3, 0, 1));
  if (ahead && beside) options.focal_length_px = std::max(1.0, (*beside - *ahead).norm() / 1e-3);
  return options;
}

Status Lesson::on_sample(const Sample& sample) {
  if (const auto* picture = std::get_if<CameraFrame>(&sample))
    return record_picture(*picture, images_, recorder_);
  monitor_.add(sample);
  if (const auto* frame = std::get_if<TagFrame>(&sample)) {
    teacher_.watch(*frame);
    console_.live(live_words(*frame));
  }
  if (const auto* odometry = std::get_if<Odometry>(&sample)) teacher_.add(*odometry);
  return recorder_.add(sample);
}

Status Lesson::on_picture(const SeenPicture& seen) {
  Status status = recorder_.add_message(kTruthTags, seen.found.stamp, ros2::to_ros(true_corners(seen)));
  if (!status || images_.empty()) return status;
  return record_picture({.stamp = seen.found.stamp, .image = seen.picture.image}, images_, recorder_);
}

TeachSummary Lesson::summary() const {
  TeachSummary summary = teacher_.summary();
  for (std::string& words : monitor_.summary()) summary.warnings.push_back(std::move(words));
  return summary;
}

std::string Lesson::live_words(const TagFrame& frame) const {
  std::string words =
      fmt::format("{:.1f} s, {} tags", to_seconds(frame.stamp.time_since_epoch()), frame.detections.size());
  for (const std::string& warning : monitor_.live()) words += "; " + warning;
  return words + ". Ctrl-C stops the robot.";
}

}  // namespace waymark::cli

#include "waymark/runtime/lap_monitor.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include <fmt/format.h>

namespace waymark {

TeachMonitorOptions monitor_options(const CameraModel& camera, std::optional<double> exposure_ms) {
  TeachMonitorOptions options;
  if (exposure_ms) options.exposure_ms = *exposure_ms;
  // Pixels a radian in the middle of the picture, whatever the model.
  const auto ahead = camera.project(Eigen::Vector3d(0, 0, 1));
  const auto beside = camera.project(Eigen::Vector3d(1e-3, 0, 1));
  if (ahead && beside) options.focal_length_px = std::max(1.0, (*beside - *ahead).norm() / 1e-3);
  return options;
}

Status LapMonitor::receive(const Sample& sample) {
  if (std::holds_alternative<CameraFrame>(sample)) return listener_.on_sample(sample);
  monitor_.add(sample);
  if (const auto* frame = std::get_if<TagFrame>(&sample)) {
    teacher_.watch(*frame);
    listener_.on_progress(progress(frame->stamp, frame->detections.size()));
  }
  if (const auto* frame = std::get_if<TagPoseFrame>(&sample)) {
    teacher_.watch(*frame);
    listener_.on_progress(progress(frame->stamp, frame->tags.size()));
  }
  if (const auto* odometry = std::get_if<Odometry>(&sample)) teacher_.add(*odometry);
  return listener_.on_sample(sample);
}

TeachSummary LapMonitor::summary() const {
  TeachSummary summary = teacher_.summary();
  for (std::string& words : monitor_.summary()) summary.warnings.push_back(std::move(words));
  return summary;
}

std::string LapMonitor::progress(SensorTime stamp, std::size_t tags) {
  if (!began_) began_ = stamp;
  std::string words = fmt::format("{:.1f} s, {} tags", to_seconds(stamp - *began_), tags);
  for (const std::string& warning : monitor_.live()) words += "; " + warning;
  return words + ". Ctrl-C stops the robot.";
}

}  // namespace waymark

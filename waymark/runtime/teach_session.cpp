#include "waymark/runtime/teach_session.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include <fmt/format.h>

namespace waymark {

TeachMonitorOptions monitor_options(const CameraModel& camera, std::optional<double> exposure_ms) {
  TeachMonitorOptions options;
  if (exposure_ms) options.exposure_ms = *exposure_ms;
  // Pixels per radian at the image centre, for any camera model.
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
  std::string text = fmt::format("{:.1f} s, {} tags", to_seconds(stamp - *began_), tags);
  for (const std::string& warning : monitor_.live()) text += "; " + warning;
  return text + ". Ctrl-C stops the robot.";
}

Status TeachSession::receive(const Sample& sample) {
  driver_.receive(sample);
  odometry_.received = odometry_.received || std::holds_alternative<Odometry>(sample);
  camera_.received = camera_.received || std::holds_alternative<TagFrame>(sample) ||
                     std::holds_alternative<TagPoseFrame>(sample) ||
                     std::holds_alternative<CameraFrame>(sample);
  return lap_.receive(sample);
}

/// Reports each silence only once.
void TeachSession::notice_silence(Stream& stream, Duration uptime, const char* what) {
  if (stream.received)
    stream = {.received = false, .silence_reported = false, .last = uptime, .ever_received = true};
  if (stream.silence_reported || to_seconds(uptime - stream.last) < options_.silence_s) return;
  stream.silence_reported = true;
  const bool camera_missing = &stream == &camera_ && !stream.ever_received;
  lap_.listener().on_message(fmt::format(
      "no {} for {:.0f} s. {}", what, options_.silence_s,
      camera_missing
          ? "Does the robot send images or tags? Select a camera of this computer with `camera_source`"
          : "Is the robot still running?"));
}

Result<DriverDecision> TeachSession::decide(Duration uptime, SensorTime now) {
  notice_silence(odometry_, uptime, "odometry");
  notice_silence(camera_, uptime, "camera frame");
  Result<DriverDecision> decision = driver_.drive(uptime, now);
  if (!decision) return decision;
  for (const std::string& message : decision->messages) lap_.listener().on_message(message);
  const SessionRequest request = requests_(uptime);
  for (const std::string& message : request.messages) lap_.listener().on_message(message);
  if (request.pose) lap_.listener().on_message("the given pose has no effect while a lap is being taught");
  finished_ = decision->done = decision->done || request.end;
  if (finished_ || request.command_zero) decision->command = {};
  return decision;
}

RobotListener TeachSession::listener() {
  RobotListener listener;
  listener.on_sample = [this](const Sample& sample) { return receive(sample); };
  listener.decide = [this](Duration uptime, SensorTime now) { return decide(uptime, now); };
  return listener;
}

LapEnd TeachSession::end(const RobotLoopEnd& loop) const {
  return {.finished = finished_, .interrupted = loop.interrupted, .lap_s = loop.seconds};
}

}  // namespace waymark

#include "waymark/runtime/localize_session.hpp"

#include <variant>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMaxNamed = 6;

}  // namespace

Status LocalizeSession::receive(const Sample& sample) {
  localizer_.add(sample);
  if (const auto* frame = std::get_if<TagFrame>(&sample);
      frame != nullptr && !estimated_ && tags_.size() < kMaxNamed)
    for (const TagDetection& detection : frame->detections) tags_.insert(detection.tag);
  streams_[0].received = streams_[0].received || std::holds_alternative<Odometry>(sample);
  streams_[1].received = streams_[1].received || std::holds_alternative<TagFrame>(sample) ||
                         std::holds_alternative<TagPoseFrame>(sample) ||
                         std::holds_alternative<RangeBearing>(sample);
  Status status = listener_.on_sample(sample);
  for (const NisRecord& record : localizer_.method().comparisons())
    if (status) status = listener_.on_comparison(record);
  localizer_.method().clear_comparisons();
  const auto estimate = localizer_.estimate();
  if (!status || !estimate || (estimated_ && estimate->stamp <= *estimated_)) return status;
  estimated_ = estimate->stamp;
  estimating_ = true;
  return listener_.on_estimate(*estimate);
}

void LocalizeSession::notice_silence(Stream& stream, Duration uptime) const {
  if (stream.received)
    stream = {.name = stream.name,
              .received = false,
              .silence_reported = false,
              .last = uptime,
              .ever_received = true};
  if (stream.silence_reported || to_seconds(uptime - stream.last) < options_.silence_s) return;
  stream.silence_reported = true;
  const bool camera_missing = &stream == &streams_.front() && !stream.ever_received;
  listener_.on_message(fmt::format(
      "no {} for {:.0f} s. {}", stream.name, options_.silence_s,
      camera_missing ? "Does the robot send them? Select a camera of this computer with `camera_source`"
                     : "Is the robot still running?"));
}

/// Warns once if the robot has observed tags for a while but there is no estimate.
void LocalizeSession::notice_foreign_tags(Duration uptime) {
  if (estimated_ || tags_.empty() || foreign_tags_reported_) return;
  constexpr double kPatience_s = 3;
  if (!tags_since_) tags_since_ = uptime;
  if (to_seconds(uptime - *tags_since_) < kPatience_s) return;
  foreign_tags_reported_ = true;
  std::string names;
  for (const TagId& tag : tags_) names += (names.empty() ? "" : ", ") + to_string(tag);
  listener_.on_message(fmt::format(
      "observed tags ({}) give no pose. Is it the map of this place and of this tag family?", names));
}

Result<DriverDecision> LocalizeSession::decide(Duration uptime, SensorTime now) {
  for (Stream& stream : streams_) notice_silence(stream, uptime);
  notice_foreign_tags(uptime);
  if (estimating_) estimated_at_ = uptime;
  estimating_ = false;
  // Reports immediately after the robot's clock has been set back.
  if (!next_report_ || now >= *next_report_ || now < *next_report_ - 2 * options_.report_every) {
    next_report_ = now + options_.report_every;
    auto estimate = localizer_.estimate();
    if (to_seconds(uptime - estimated_at_) >= options_.silence_s) estimate.reset();
    listener_.on_report(now, estimate);
  }
  const SessionRequest request = requests_(uptime);
  for (const std::string& message : request.messages) listener_.on_message(message);
  if (request.pose) restart_from(*request.pose);
  finished_ = finished_ || request.end || to_seconds(uptime) >= options_.most_s;
  return DriverDecision{.done = finished_};
}

void LocalizeSession::restart_from(const GivenPose& given) {
  const SE2& pose = given.map_T_base;
  const std::string where = fmt::format("pose given: x {:.2f} m, y {:.2f} m, heading {:.0f} deg", pose.x(),
                                        pose.y(), to_degrees(pose.yaw()));
  listener_.on_message(localizer_.method().restart_from(given)
                           ? where + "; it is certain as soon as tags agree"
                           : where + "; ignored, because this method uses tags alone");
}

RobotListener LocalizeSession::listener() {
  RobotListener listener;
  listener.on_sample = [this](const Sample& sample) { return receive(sample); };
  listener.decide = [this](Duration uptime, SensorTime now) { return decide(uptime, now); };
  return listener;
}

LocalizeEnd LocalizeSession::end(const RobotLoopEnd& loop) const {
  return {.finished = finished_, .interrupted = loop.interrupted, .seconds = loop.seconds};
}

}  // namespace waymark

#include "waymark/runtime/localize_session.hpp"

#include <variant>

#include <fmt/format.h>

namespace waymark {

Status LocalizeSession::receive(const Sample& sample) {
  localizer_.add(sample);
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
  return listener_.on_estimate(*estimate);
}

void LocalizeSession::notice_silence(Stream& stream, Duration uptime) const {
  if (stream.received) stream = {.name = stream.name, .received = false, .said = false, .last = uptime};
  if (stream.said || to_seconds(uptime - stream.last) < options_.silence_s) return;
  stream.said = true;
  listener_.on_words(
      fmt::format("no {} for {:.0f} s: does the robot still run?", stream.name, options_.silence_s));
}

Result<DriverDecision> LocalizeSession::decide(Duration uptime, SensorTime now) {
  for (Stream& stream : streams_) notice_silence(stream, uptime);
  // A robot whose clock was set back is reported on at once.
  if (!next_report_ || now >= *next_report_ || now < *next_report_ - 2 * options_.report_every) {
    next_report_ = now + options_.report_every;
    listener_.on_report(now, localizer_.estimate());
  }
  finished_ = finished_ || requests_(uptime).end || to_seconds(uptime) >= options_.most_s;
  return DriverDecision{.done = finished_};
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

#include "waymark/runtime/explore_session.hpp"

#include <variant>

#include <fmt/format.h>

namespace waymark {

Status ExploreSession::receive(const Sample& sample) {
  if (const auto* scan = std::get_if<LaserScan>(&sample)) explorer_.add(*scan);
  if (const auto* frame = std::get_if<TagFrame>(&sample)) {
    for (const TagDetection& detection : frame->detections) {
      if (tags_.find(detection.tag) != nullptr) ++end_.seen[detection.tag];
    }
  }
  localizer_.add(sample);
  return listener_.on_sample(sample);
}

Result<DriverDecision> ExploreSession::decide(Duration uptime, SensorTime now) {
  const ExploreStep step = explorer_.step(now);
  end_.halt_reason = step.reason.value_or("");
  const auto estimate = localizer_.estimate();
  listener_.on_progress(progress(uptime, estimate && estimate->certain));
  if (Status status = listener_.on_step(now, step, estimate); !status) return tl::unexpected(status.error());
  end_.finished = to_seconds(uptime) >= most_s_;
  return DriverDecision{.command = step.command, .done = end_.finished};
}

std::string ExploreSession::progress(Duration uptime, bool certain) const {
  return fmt::format("{:.0f} of {:.0f} s, {} of {} tags observed, {}. Ctrl-C stops the robot.",
                     to_seconds(uptime), most_s_, end_.seen.size(), tags_.tags.size(),
                     certain ? "localised" : "not localised");
}

RobotListener ExploreSession::listener() {
  RobotListener listener;
  listener.on_sample = [this](const Sample& sample) { return receive(sample); };
  listener.decide = [this](Duration uptime, SensorTime now) { return decide(uptime, now); };
  return listener;
}

ExploreEnd ExploreSession::end() const {
  ExploreEnd end = end_;
  end.turns = explorer_.turns();
  return end;
}

ExploreEnd ExploreSession::end(const RobotLoopEnd& loop) const {
  ExploreEnd end = this->end();
  end.interrupted = loop.interrupted;
  end.seconds = to_seconds(loop.uptime);
  return end;
}

}  // namespace waymark

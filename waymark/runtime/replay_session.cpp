#include "waymark/runtime/replay_session.hpp"

#include <utility>
#include <variant>

namespace waymark {

Status ReplaySession::hear(const Sample& sample) {
  if (const auto* frame = std::get_if<TagFrame>(&sample)) {
    replayer_.add(*frame);
    ++end_.frames;
    end_.frames_with_two_tags += frame->detections.size() >= 2 ? 1 : 0;
  }
  if (const auto* odometry = std::get_if<Odometry>(&sample)) replayer_.add(*odometry);
  if (const auto* imu = std::get_if<ImuSample>(&sample)) replayer_.add(*imu);
  if (const auto* scan = std::get_if<LaserScan>(&sample)) replayer_.add(*scan);
  return listener_.on_sample(sample);
}

Result<DriverDecision> ReplaySession::decide(Duration uptime, SensorTime now) {
  const ReplayStep step = replayer_.step(now);
  end_.state = step.state;
  end_.reason = step.reason.value_or("");
  end_.driven_m = step.driven_m;
  const bool goes_on = step.state == ReplayState::Driving || step.state == ReplayState::AtStation || paused_;
  if (goes_on || !goes_) goes_ = uptime;
  if (Status status = listener_.on_step(now, step); !status) return tl::unexpected(status.error());
  end_.finished = step.state == ReplayState::Finished;
  const bool refused = step.state == ReplayState::Refused;
  end_.given_up = !end_.finished && !refused && to_seconds(uptime - *goes_) >= options_.give_up_s;
  return DriverDecision{.command = step.command, .done = end_.finished || refused || end_.given_up};
}

void ReplaySession::pause() {
  paused_ = true;
  replayer_.pause("paused by the operator");
}

void ReplaySession::resume() {
  paused_ = false;
  replayer_.resume();
}

RobotListener ReplaySession::listener() {
  RobotListener listener;
  listener.on_sample = [this](const Sample& sample) { return hear(sample); };
  listener.decide = [this](Duration uptime, SensorTime now) { return decide(uptime, now); };
  return listener;
}

ReplayEnd ReplaySession::end() const {
  ReplayEnd end = end_;
  end.stops = replayer_.stops();
  return end;
}

ReplayEnd ReplaySession::end(const RobotLoopEnd& loop) const {
  ReplayEnd end = this->end();
  end.interrupted = loop.interrupted;
  end.timed_out = loop.timed_out;
  end.lap_s = loop.seconds;
  return end;
}

}  // namespace waymark

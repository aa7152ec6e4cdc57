#include "waymark/runtime/replay_session.hpp"

#include <algorithm>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "waymark/samples/odometry_jump.hpp"

namespace waymark {

namespace {

bool is_sensed(const Sample& sample) {
  return !std::holds_alternative<StampedCommand>(sample) && !std::holds_alternative<TruthPose>(sample) &&
         !std::holds_alternative<GamepadState>(sample);
}

/// Removes the advice from a reason, because it no longer applies after the end.
std::string without_advice(std::string reason) {
  constexpr std::string_view kAdvice = "Check the robot, then resume";
  if (!reason.ends_with(kAdvice)) return reason;
  reason.erase(reason.size() - kAdvice.size());
  reason.erase(reason.find_last_not_of(" :.") + 1);
  return reason;
}

}  // namespace

template <class Frame, class Seen>
void ReplaySession::count(const Frame& frame, const std::vector<Seen>& seen) {
  replayer_.add(frame);
  ++end_.frames;
  std::vector<TagId> tags;
  tags.reserve(seen.size());
  for (const Seen& one : seen) {
    if constexpr (std::is_same_v<Seen, TagDetection>)
      if (!usable_corners(one)) continue;
    tags.push_back(one.tag);
  }
  in_view_.add(frame.camera, frame.stamp, std::move(tags));
  end_.frames_with_two_tags += in_view_.count(frame.stamp) >= 2 ? 1 : 0;
}

Status ReplaySession::receive(const Sample& sample) {
  if (is_sensed(sample)) newest_ = newest_ ? std::max(*newest_, stamp_of(sample)) : stamp_of(sample);
  if (const auto* frame = std::get_if<TagFrame>(&sample)) count(*frame, frame->detections);
  if (const auto* frame = std::get_if<TagPoseFrame>(&sample)) count(*frame, frame->tags);
  if (const auto* odometry = std::get_if<Odometry>(&sample)) {
    notice_jump(*odometry);
    replayer_.add(*odometry);
  }
  if (const auto* imu = std::get_if<ImuSample>(&sample)) replayer_.add(*imu);
  if (const auto* scan = std::get_if<LaserScan>(&sample)) replayer_.add(*scan);
  return listener_.on_sample(sample);
}

void ReplaySession::receive_missed(std::vector<MissedTag> missed) {
  for (const MissedTag& one : missed) ++end_.missed_tags[one.why];
  replayer_.add(std::move(missed));
}

void ReplaySession::notice_jump(const Odometry& odometry) {
  if (odometry_ && odometry_jumped(*odometry_, odometry))
    listener_.on_message(
        "odometry jumped, as after a restart of the robot or a reset of its odometry. The motion in between "
        "is "
        "estimated from tags alone");
  odometry_ = odometry;
}

/// Real silence is visible both in the timestamps and on this computer's clock. A jump of the robot's clock
/// is visible only in the timestamps, and an overload of this computer only on its own clock.
void ReplaySession::pause_after_silence(Duration uptime) {
  if (newest_ == newest_before_) return;
  const double stamps_s = newest_before_ ? to_seconds(*newest_ - *newest_before_) : 0;
  const double silent_s = std::min(stamps_s, to_seconds(uptime - received_at_));
  newest_before_ = newest_;
  received_at_ = uptime;
  if (silent_s <= options_.ask_after_silence_s || end_.state == ReplayState::Waiting) return;
  replayer_.pause(fmt::format("no sensor sample for {:.1f} s. Check the robot, then resume", silent_s));
}

Result<DriverDecision> ReplaySession::decide(Duration uptime, SensorTime now) {
  const SessionRequest request = requests_(uptime);
  if (request.end) {
    ended_by_ = request.reason;
    return DriverDecision{.done = true};
  }
  for (const std::string& message : request.messages) listener_.on_message(message);
  if (request.pause) *request.pause ? pause() : resume();
  if (request.pose) restart_from(*request.pose);
  return follow(uptime, now);
}

Result<DriverDecision> ReplaySession::follow(Duration uptime, SensorTime now) {
  pause_after_silence(uptime);
  const ReplayStep step = replayer_.step(now);
  end_.state = step.state;
  end_.reason = step.reason.value_or("");
  end_.driven_m = step.driven_m;
  const bool goes_on = step.state == ReplayState::Driving || step.state == ReplayState::AtStation || paused_;
  if (goes_on || !goes_) goes_ = uptime;
  if (Status status = listener_.on_step(now, step); !status) return tl::unexpected(status.error());
  end_.finished = step.state == ReplayState::Finished;
  const bool over = !is_live(step.state);  // whether it is finished, was refused, or ended before the whole
                                           // route was driven
  end_.given_up = !over && to_seconds(uptime - *goes_) >= options_.give_up_s;
  return DriverDecision{.command = step.command, .done = over || end_.given_up};
}

void ReplaySession::pause() {
  paused_ = true;
  replayer_.pause("paused by the operator");
}

void ReplaySession::restart_from(const GivenPose& given) {
  paused_ = true;
  replayer_.restart_from(given);
}

void ReplaySession::resume() {
  paused_ = false;
  replayer_.resume();
}

RobotListener ReplaySession::listener() {
  RobotListener listener;
  listener.on_sample = [this](const Sample& sample) { return receive(sample); };
  listener.decide = [this](Duration uptime, SensorTime now) { return decide(uptime, now); };
  listener.expected = [this](const MountedCamera& camera, SensorTime stamp) {
    return expected(camera, stamp);
  };
  listener.on_missed = [this](std::vector<MissedTag> missed) { receive_missed(std::move(missed)); };
  return listener;
}

ReplayEnd ReplaySession::end() const {
  ReplayEnd end = end_;
  end.stops = replayer_.stops();
  end.reason = ended_by_.empty() ? without_advice(std::move(end.reason)) : ended_by_;
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

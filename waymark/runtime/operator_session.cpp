#include "waymark/runtime/operator_session.hpp"

#include <utility>
#include <variant>

#include <fmt/format.h>

namespace waymark {
namespace {

using A = OperatorAction;
using E = OperatorEvent;
using S = OperatorState;

/// Whether a sample comes from the robot, rather than being operator input or a command.
bool is_of_robot(const Sample& sample) {
  return !std::holds_alternative<GamepadState>(sample) && !std::holds_alternative<StampedCommand>(sample);
}

}  // namespace

Status OperatorSession::receive(const Sample& sample) {
  input_.receive(sample);
  received_ = received_ || is_of_robot(sample);
  if (lap_open_) return tasks_.add_to_lap(sample);
  return replay_ != nullptr ? replay_->receive(sample) : Status();
}

Result<DriverDecision> OperatorSession::decide(Duration uptime, SensorTime now) {
  tasks_.on_decision(operator_, input_);
  notice_silence(uptime);
  Result<OperatorRequest> request = input_.read(uptime, now, operator_.state());
  if (!request) return tl::unexpected(request.error());
  if (stop_pressed_()) request->events.insert(request->events.begin(), E::Stop);
  for (const std::string& message : request->messages) tasks_.on_message(message);
  Status status = request->pad && lap_open_ ? tasks_.add_to_lap(*request->pad) : Status();
  for (const E event : request->events) {
    if (status) status = handle(event, uptime);
  }
  if (request->pose) restart_from(*request->pose);
  if (status) status = take_finished_map(uptime);
  Result<VelocityCommand> wanted = status ? replay(uptime, now) : tl::unexpected(status.error());
  if (!wanted) return tl::unexpected(wanted.error());
  return DriverDecision{.command = operator_.permit(request->command, *wanted),
                        .done = operator_.state() == S::Over};
}

RobotListener OperatorSession::listener() {
  RobotListener listener;
  listener.on_sample = [this](const Sample& sample) { return receive(sample); };
  listener.decide = [this](Duration uptime, SensorTime now) { return decide(uptime, now); };
  listener.expected = [this](const MountedCamera& camera, SensorTime stamp) {
    return replay_ != nullptr ? replay_->expected(camera, stamp) : std::vector<ExpectedTag>();
  };
  listener.on_missed = [this](std::vector<MissedTag> missed) {
    if (replay_ != nullptr) replay_->receive_missed(std::move(missed));
  };
  return listener;
}

/// Used only while a lap is taught, because a replay detects silence itself.
void OperatorSession::notice_silence(Duration uptime) {
  constexpr Duration kSilence = std::chrono::seconds(2);
  if (std::exchange(received_, false) || !lap_open_) {
    last_received_ = uptime;
    silence_reported_ = false;
  }
  if (uptime - last_received_ < kSilence || std::exchange(silence_reported_, true)) return;
  tasks_.on_message(
      fmt::format("no sample of the robot for {:.0f} s. Is it still running?", to_seconds(kSilence)));
}

void OperatorSession::restart_from(const GivenPose& given) {
  if (replay_ == nullptr)
    return tasks_.on_message("the given pose has no effect because no replay is active");
  tasks_.on_message("the replay is paused because a pose was given");
  replay_->restart_from(given);
}

/// The replay is also updated while it is paused, so that it keeps its position; permit() suppresses its
/// commands.
Result<VelocityCommand> OperatorSession::replay(Duration uptime, SensorTime now) {
  const bool paused = operator_.state() == S::Paused;
  if (operator_.state() != S::Replaying && !paused) return VelocityCommand{};
  const Result<DriverDecision> decision = replay_->decide(uptime, now);
  if (!decision) return tl::unexpected(decision.error());
  if (paused || !decision->done) return decision->command;
  const ReplayEnd end = replay_->end();
  Status status =
      end.finished ? handle(E::ReplayFinished, uptime) : handle(E::ReplayStopped, uptime, end.reason);
  if (!status) return tl::unexpected(status.error());
  return VelocityCommand{};
}

Status OperatorSession::handle(E event, Duration uptime, std::string reason) {
  const S before = operator_.state();
  const Result<A> action = operator_.handle(event, uptime, std::move(reason));
  if (!action) {
    if (event != E::StickMoved) tasks_.on_message(action.error().message);
    return {};
  }
  Status status = act(*action);
  const S after = operator_.state();
  if (after != before && after != S::Over) tasks_.on_state(operator_, input_.buttons(after));
  return status;
}

Status OperatorSession::act(A action) {
  switch (action) {
    case A::StartLap:
      return start_lap();
    case A::FinishLap:
      return map_lap();
    case A::DropLap:
    case A::Leave:
    case A::EndReplay: {
      Status status = end_lap();
      return status ? end_replay(false) : status;
    }
    case A::StartReplay:
      return start_replay();
    case A::PauseReplay:
      replay_->pause();
      return {};
    case A::ResumeReplay:
      replay_->resume();
      return {};
    case A::Nothing:
      break;
  }
  return {};
}

Status OperatorSession::start_lap() {
  Status status = tasks_.start_lap();
  lap_open_ = status.has_value();
  return status;
}

Status OperatorSession::end_lap() { return std::exchange(lap_open_, false) ? tasks_.end_lap() : Status(); }

Status OperatorSession::map_lap() {
  if (Status status = end_lap(); !status) return status;
  ++laps_taught_;
  Status status = tasks_.start_map();
  mapping_ = status.has_value();
  return status;
}

Status OperatorSession::take_finished_map(Duration uptime) {
  if (!mapping_ || !tasks_.map_ended()) return {};
  mapping_ = false;
  Status made = tasks_.take_map();
  if (made) made = tasks_.load_map();
  map_failed_ = !made;
  return made ? handle(E::MapMade, uptime) : handle(E::MapFailed, uptime, to_string(made.error()));
}

Status OperatorSession::start_replay() {
  const Result<ReplaySession*> replay = tasks_.start_replay();
  if (!replay) return tl::unexpected(replay.error());
  replay_ = *replay;
  return {};
}

Status OperatorSession::end_replay(bool interrupted) {
  if (replay_ == nullptr) return {};
  ReplayEnd end = std::exchange(replay_, nullptr)->end();
  end.interrupted = interrupted;
  if (interrupted) end.reason = "stopped by a signal";
  if (end.reason.empty())  // the replay ended while driving
    end.reason = operator_.state() == S::Over ? "the session was ended" : operator_.reason();
  return tasks_.end_replay(end);
}

Status OperatorSession::finish(bool interrupted) {
  Status lap = end_lap();
  Status replay = end_replay(interrupted);
  if (std::exchange(mapping_, false)) {
    const Status made = tasks_.take_map();
    if (lap) lap = made;
  }
  return lap ? replay : lap;
}

}  // namespace waymark

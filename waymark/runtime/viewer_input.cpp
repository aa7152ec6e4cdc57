#include "waymark/runtime/viewer_input.hpp"

#include <utility>

namespace waymark {
namespace {

using E = OperatorEvent;
using S = OperatorState;

/// If the page goes silent, driving stops after this time.
constexpr Duration kHold = std::chrono::milliseconds(500);
/// Longer than the 0.3 s within which an operator's session ignores a second press.
constexpr Duration kAskAgain = std::chrono::milliseconds(400);

}  // namespace

void ViewerRequests::notice_control(ViewerControl control, Duration uptime, S state) {
  if (control == ViewerControl::Lost && before_ != ViewerControl::Lost) {
    command_zero_ = state == S::Teaching;
    pause_ = state == S::Replaying;
    pause_asked_ = uptime - kAskAgain;
    commanded_at_.reset();
  }
  before_ = control;
  if (control == ViewerControl::Held) command_zero_ = false;
}

void ViewerRequests::apply_order(const ViewerOrder& order, Duration uptime, S state, Request& request) {
  using Kind = ViewerOrder::Kind;
  if (order.kind == Kind::Go) request.events.push_back(E::Go);
  if (order.kind == Kind::Teach) request.events.push_back(E::Teach);
  if (order.kind == Kind::Stop) request.events.push_back(E::Stop);
  if (order.kind == Kind::Quit) request.events.push_back(E::Quit);
  if (order.kind == Kind::Message) request.messages.push_back(order.message);
  if (order.kind == Kind::GivePose) {
    request.pose = order.pose;
    pause_ = state == S::Replaying;
    pause_asked_ = uptime - kAskAgain;
  }
  if (order.kind == Kind::Script) {
    request.script = true;
    commanded_at_.reset();  // set by a viewer that was driving
  }
  if (order.kind != Kind::Velocity) return;
  if (state != S::Teaching && order.command != VelocityCommand{}) request.events.push_back(E::StickMoved);
  command_ = order.command;
  commanded_at_ = uptime;
}

ViewerRequests::Request ViewerRequests::read(Duration uptime, S state) {
  Request request;
  // The order matters: a viewer whose orders were read was in control at that time. If control turns out to
  // be lost now, that viewer left afterwards.
  const std::vector<ViewerOrder> orders = link_.take_orders();
  const ViewerControl control = link_.control();
  notice_control(control, uptime, state);
  for (const ViewerOrder& order : orders) {
    // Orders from a viewer that has left must not cause motion.
    if (control == ViewerControl::Lost && order.kind != ViewerOrder::Kind::Stop) continue;
    apply_order(order, uptime, state, request);
  }
  pause_ = pause_ && state == S::Replaying;
  if (pause_ && uptime - pause_asked_ >= kAskAgain) {
    request.events.push_back(E::Go);
    pause_asked_ = uptime;
  }
  if (state != S::Teaching) command_zero_ = false;
  if (commanded_at_ && uptime - *commanded_at_ > kHold) commanded_at_.reset();
  if (commanded_at_) request.drive = command_;
  request.command_zero = command_zero_;
  return request;
}

Result<OperatorRequest> ViewerInput::read(Duration uptime, SensorTime now, S state) {
  Result<OperatorRequest> request = other_ ? other_->read(uptime, now, state) : OperatorRequest{};
  if (!request) return request;
  const bool acts = !request->events.empty() || request->command != VelocityCommand{};
  if (acts && other_ && other_->is_person()) requests_.driver_is_present();
  ViewerRequests::Request page = requests_.read(uptime, state);
  if (page.script && has_script() && state == S::Teaching) scripting_ = true;
  if (state != S::Teaching || page.drive) scripting_ = false;
  if (state != S::Teaching && std::exchange(script_used_, false))
    script_ = make_script_();  // create a new one for the next lap
  script_used_ = script_used_ || scripting_;
  if (scripting_ && !page.command_zero) {
    const Result<DriverDecision> decision = script_->drive(uptime, now);
    if (!decision) return tl::unexpected(decision.error());
    request->command = decision->command;
    if (decision->done) page.events.push_back(E::Go);
  }
  request->pose = page.pose;
  request->messages.insert(request->messages.end(), page.messages.begin(), page.messages.end());
  if (page.drive) request->command = *page.drive;
  if (page.command_zero) request->command = {};
  request->events.insert(request->events.end(), page.events.begin(), page.events.end());
  return request;
}

void ViewerInput::receive(const Sample& sample) {
  truth_received_ = truth_received_ || std::holds_alternative<TruthPose>(sample);
  if (other_) other_->receive(sample);
  if (script_) script_->receive(sample);
}

std::string ViewerInput::usage() const {
  const ViewerLabels& labels = requests_.labels();
  return other_ ? other_->usage() + "; " + labels.beside : labels.alone;
}

SessionRequest PhaseRequests::read(Duration uptime) {
  SessionRequest request;
  request.end = stop_pressed_();
  if (request.end) request.reason = "stopped with the space bar";
  if (!requests_) return request;
  ViewerRequests::Request asked = requests_->read(uptime, phase_);
  request.command_zero = asked.command_zero;
  request.pose = asked.pose;
  request.messages = std::move(asked.messages);
  for (const E event : asked.events) {
    const bool go = event == E::Go;
    request.end = request.end || event == E::Stop || event == E::Quit || (go && phase_ == S::Teaching);
    if (!go || phase_ == S::Teaching) continue;
    request.pause = phase_ == S::Replaying;
    phase_ = *request.pause ? S::Paused : S::Replaying;
  }
  if (request.end && request.reason.empty()) request.reason = requests_->labels().stopped;
  return request;
}

std::vector<std::string> viewer_commands(S state, bool has_script) {
  std::vector<std::string> commands;
  if (state != S::Mapping && state != S::Over) commands.emplace_back("go");
  if (state == S::Teaching || state == S::Replaying || state == S::Paused) commands.emplace_back("stop");
  if (state == S::Teaching && has_script) commands.emplace_back("script");
  // In other states "go" already has this effect, or a drive is in progress.
  if (state == S::Ready || state == S::Done || state == S::Stopped) commands.emplace_back("teach");
  if (state != S::Over) commands.emplace_back("quit");
  return commands;
}

}  // namespace waymark

#include "waymark/cli/page_pilot.hpp"

#include <utility>

namespace waymark::cli {
namespace {

using E = OperatorEvent;
using S = OperatorState;
using Control = LiveFeed::Control;

/// A page that falls silent drives no more.
constexpr Duration kHold = std::chrono::milliseconds(500);
/// The story takes two presses within 0.3 s for one.
constexpr Duration kAskAgain = std::chrono::milliseconds(400);

}  // namespace

PageOrders::Act PageOrders::act(Duration uptime, S state) {
  Act act;
  // In this order: whoever gave these orders held control then, and if it is lost now, has gone since.
  const std::vector<ViewerOrder> orders = feed_.take_orders();
  const Control control = feed_.control();
  if (control == Control::Lost && before_ != Control::Lost) {
    stand_ = state == S::Teaching;
    pause_ = state == S::Replaying;
    pause_asked_ = uptime - kAskAgain;
    told_.reset();
  }
  before_ = control;
  if (control == Control::Held) stand_ = false;
  for (const ViewerOrder& order : orders) {
    using Kind = ViewerOrder::Kind;
    // What somebody asked for who has gone since moves nothing any more.
    if (control == Control::Lost && order.kind != Kind::Stop) continue;
    if (order.kind == Kind::Go) act.events.push_back(E::Go);
    if (order.kind == Kind::Stop) act.events.push_back(E::Stop);
    if (order.kind == Kind::Quit) act.events.push_back(E::Quit);
    if (order.kind == Kind::Script) {
      act.script = true;
      told_.reset();  // the hand that drove a moment ago lets go
    }
    if (order.kind != Kind::Velocity) continue;
    if (state != S::Teaching && order.command != VelocityCommand{}) act.events.push_back(E::StickMoved);
    command_ = order.command;
    told_ = uptime;
  }
  pause_ = pause_ && state == S::Replaying;
  if (pause_ && uptime - pause_asked_ >= kAskAgain) {
    act.events.push_back(E::Go);
    pause_asked_ = uptime;
  }
  if (state != S::Teaching) stand_ = false;
  if (told_ && uptime - *told_ > kHold) told_.reset();
  if (told_) act.drive = command_;
  act.stand = stand_;
  return act;
}

Result<PilotAct> PagePilot::act(Duration uptime, SensorTime now, S state) {
  Result<PilotAct> act = other_ ? other_->act(uptime, now, state) : PilotAct{};
  if (!act) return act;
  const bool acts = !act->events.empty() || act->command != VelocityCommand{};
  if (acts && other_ && other_->is_person()) orders_.somebody_is_here();
  PageOrders::Act page = orders_.act(uptime, state);
  if (page.script && has_script() && state == S::Teaching) scripting_ = true;
  if (state != S::Teaching || page.drive) scripting_ = false;
  if (state != S::Teaching && std::exchange(script_used_, false))
    script_ = make_script_();  // for the next lap
  script_used_ = script_used_ || scripting_;
  if (scripting_ && !page.stand) {
    const Result<DriverDecision> decision = script_->drive(uptime, now);
    if (!decision) return tl::unexpected(decision.error());
    act->command = decision->command;
    if (decision->done) page.events.push_back(E::Go);
  }
  if (page.drive) act->command = *page.drive;
  if (page.stand) act->command = {};
  act->events.insert(act->events.end(), page.events.begin(), page.events.end());
  return act;
}

void PagePilot::hear(const Sample& sample) {
  truth_heard_ = truth_heard_ || std::holds_alternative<TruthPose>(sample);
  if (other_) other_->hear(sample);
  if (script_) script_->hear(sample);
}

std::string PagePilot::usage() const {
  return other_ ? other_->usage() + "; the page has the same buttons" : "the page has the buttons";
}

LiveStatus status_of(const Operator& story, const Pilot& pilot) {
  LiveStatus status{.phase = std::string(to_string(story.state())),
                    .reason = story.reason(),
                    .page_drives = pilot.page_drives()};
  const S state = story.state();
  if (state != S::Mapping && state != S::Over) status.commands.emplace_back("go");
  if (state == S::Teaching || state == S::Replaying || state == S::Paused)
    status.commands.emplace_back("stop");
  if (state == S::Teaching && pilot.has_script()) status.commands.emplace_back("script");
  if (state != S::Over) status.commands.emplace_back("quit");
  return status;
}

}  // namespace waymark::cli

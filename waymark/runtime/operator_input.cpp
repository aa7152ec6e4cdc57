#include "waymark/runtime/operator_input.hpp"

#include <thread>
#include <utility>

namespace waymark {

Result<DriverDecision> PacedDriver::drive(Duration uptime, SensorTime now) {
  if (!start_) start_ = clock_() - uptime;
  const Duration ahead = *start_ + uptime - clock_();
  if (ahead > Duration(0)) wait_(ahead);
  return driver_->drive(uptime, now);
}

std::unique_ptr<LapDriver> in_real_time(std::unique_ptr<LapDriver> driver) {
  return std::make_unique<PacedDriver>(std::move(driver), real_time().clock,
                                       [](Duration ahead) { std::this_thread::sleep_for(ahead); });
}

namespace {

using E = OperatorEvent;
using S = OperatorState;

}  // namespace

Result<OperatorRequest> ScriptInput::read(Duration uptime, SensorTime now, S state) {
  OperatorRequest request;
  const bool settled = uptime - pressed_ >= std::chrono::milliseconds(500);
  if (state == S::Teaching) {
    const Result<DriverDecision> decision = driver_->drive(uptime, now);
    if (!decision) return tl::unexpected(decision.error());
    request.command = decision->command;
    if (decision->done) request.events.push_back(E::Go);
  } else if (settled && !taught_ && state == S::Idle) {
    request.events.push_back(E::Go);
    taught_ = true;
  } else if (settled && state == S::Ready && !replayed_) {
    request.events.push_back(E::Go);
    replayed_ = true;
  } else if (!stays_ && (state == S::Done || state == S::Stopped || (taught_ && state == S::Idle))) {
    request.events.push_back(E::Quit);
  }
  if (!request.events.empty()) pressed_ = uptime;
  return request;
}

}  // namespace waymark

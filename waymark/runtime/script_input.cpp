#include "waymark/runtime/script_input.hpp"

namespace waymark {
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

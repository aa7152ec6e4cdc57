#include "waymark/runtime/step_robot.hpp"

#include <utility>

namespace waymark {

StepRobot::StepRobot(Step step, Duration period) : step_(std::move(step)), period_(period) {}

Status StepRobot::command(const VelocityCommand& command) {
  command_ = command;
  return {};
}

void StepRobot::finish() {
  if (std::exchange(obeyed_, {}) == VelocityCommand{}) return;
  clock_ += period_;
  (void)step_({}, SensorTime(clock_));  // the drive is over, so samples and errors are discarded
}

Result<std::optional<RobotEvent>> StepRobot::next(Duration /*most*/) {
  if (events_.empty()) {
    clock_ += period_;
    obeyed_ = command_;  // set even if the function fails, because the motion may have started
    Result<std::vector<Sample>> measured = step_(command_, SensorTime(clock_));
    if (!measured) return tl::unexpected(measured.error());
    for (Sample& sample : *measured) events_.emplace_back(std::move(sample));
    events_.emplace_back(CommandRequest{SensorTime(clock_)});
  }
  std::optional<RobotEvent> event(std::move(events_.front()));
  events_.pop_front();
  return event;
}

Pacing StepRobot::pacing() const {
  return lockstep_time([this] { return clock_; });
}

}  // namespace waymark

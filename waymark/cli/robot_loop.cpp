#include "waymark/cli/robot_loop.hpp"

#include <algorithm>
#include <utility>

#include "waymark/cli/interrupt.hpp"
#include "waymark/drivers/watchdog/pipes.hpp"
#include "waymark/tags/apriltag_detector.hpp"

namespace waymark::cli {
namespace {

constexpr Duration kTickPeriod = std::chrono::milliseconds(50);
constexpr Duration kResend = std::chrono::milliseconds(100);

}  // namespace

Result<std::unique_ptr<RobotLoop>> RobotLoop::open(const std::string& command, const CameraModel& camera,
                                                   Console& console) {
  auto detector = make_apriltag_detector({.min_white_black_diff = 20});
  if (!detector) return tl::unexpected(detector.error());
  auto robot = ProcessRobot::start(command);
  if (!robot) return tl::unexpected(robot.error());
  TagFinder finder{.detector = std::move(*detector), .refinement = RefinementOptions{}};
  return std::unique_ptr<RobotLoop>(new RobotLoop(std::move(*robot), std::move(finder), camera, console));
}

Status RobotLoop::hear(RobotMessage message, const RobotListener& listener) {
  if (const auto* log = std::get_if<RobotLog>(&message)) console_.say("robot: " + log->text);
  if (std::holds_alternative<RobotStep>(message)) due_ = true;
  auto* sample = std::get_if<Sample>(&message);
  if (sample == nullptr) return {};
  if (!first_) first_ = stamp_of(*sample);
  auto* picture = std::get_if<CameraFrame>(sample);
  if (picture == nullptr) return listener.on_sample(*sample);
  if (unseen_) ++dropped_;
  unseen_ = std::move(*picture);
  return {};
}

Status RobotLoop::look(const RobotListener& listener) {
  const CameraFrame picture = *std::exchange(unseen_, std::nullopt);
  if (Status status = listener.on_sample(picture); !status) return status;
  auto found = find_tags(picture.image, finder_, &camera_);
  if (!found) return tl::unexpected(found.error());
  due_ = due_ || !robot_->hello().lockstep;
  return listener.on_sample(TagFrame{picture.stamp, picture.camera, std::move(found->detections)});
}

Status RobotLoop::send(const VelocityCommand& command, SensorTime now, const RobotListener& listener) {
  last_ = command;
  if (Status status = robot_->command(command); !status) return status;
  return listener.on_sample(StampedCommand{now, command});
}

Duration RobotLoop::until_tick() const {
  if (robot_->hello().lockstep) return kResend;
  return std::clamp(next_tick_ - steady_now(), Duration(0), kTickPeriod);
}

/// False: it is over.
Result<bool> RobotLoop::tick(const RobotListener& listener) {
  const auto now = robot_->now();
  if (!now) return true;
  const bool lockstep = robot_->hello().lockstep;
  const Duration uptime = lockstep ? now->time_since_epoch() : steady_now() - start_;
  const auto command = listener.decide(uptime, *now);
  if (!command) return tl::unexpected(command.error());
  if (Status status = send(command->value_or(VelocityCommand{}), *now, listener); !status)
    return tl::unexpected(status.error());
  return command->has_value();
}

Result<RobotLoopEnd> RobotLoop::drive(const RobotListener& listener) {
  start_ = next_tick_ = steady_now();
  const bool lockstep = robot_->hello().lockstep;
  RobotLoopEnd end;
  bool over = false;
  while (!over && !(end.interrupted = interrupted())) {
    auto message = robot_->next(unseen_ ? Duration(0) : until_tick());
    if (!message) return tl::unexpected(message.error());
    Status status;
    if (*message)
      status = hear(std::move(**message), listener);
    else if (lockstep && !unseen_)
      status = robot_->command(last_);  // an answer that was lost
    for (const std::string& words : robot_->take_warnings()) console_.say("robot: " + words);
    // In lockstep every picture counts, otherwise the newest.
    if (status && unseen_ && (lockstep || !robot_->more())) status = look(listener);
    due_ = due_ || (!lockstep && steady_now() >= next_tick_);
    if (!status) return tl::unexpected(status.error());
    if (!std::exchange(due_, false)) continue;
    next_tick_ = steady_now() + kTickPeriod;
    const Result<bool> goes_on = tick(listener);
    if (!goes_on) return tl::unexpected(goes_on.error());
    over = !*goes_on;
  }
  end.interrupted = interrupted();  // also where the last decision was to end
  const auto now = robot_->now();
  if (end.interrupted && now) (void)send({}, *now, listener);
  if (now && first_) end.seconds = to_seconds(*now - *first_);
  return end;
}

}  // namespace waymark::cli

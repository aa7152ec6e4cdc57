#include "waymark/live/robot_with_cameras.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "waymark/drivers/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr Duration kRobotSlice = std::chrono::milliseconds(2);  // a picture waits no longer for the robot

}  // namespace

bool RobotWithCameras::more() const {
  return robot_.more() || std::ranges::any_of(cameras_, [](const auto& camera) { return camera->more(); });
}

/// Stamps of one camera grow also where the estimate of the robot's clock is moved back.
bool RobotWithCameras::move_to_robots_clock(CameraFrame& frame) {
  const auto now = robot_.now();
  if (!now) return false;
  const Duration age = steady_now() - frame.stamp.time_since_epoch();
  SensorTime& newest = newest_[frame.camera];
  newest = frame.stamp = std::max(*now - age, newest + Duration(1));
  return true;
}

bool RobotWithCameras::replaced(const RobotEvent& event) const {
  const auto* sample = std::get_if<Sample>(&event);
  const auto* corners = sample != nullptr ? std::get_if<TagFrame>(sample) : nullptr;
  const auto* poses = sample != nullptr ? std::get_if<TagPoseFrame>(sample) : nullptr;
  return (corners != nullptr && names_.contains(corners->camera)) ||
         (poses != nullptr && names_.contains(poses->camera));
}

Result<std::optional<RobotEvent>> RobotWithCameras::of_cameras() {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    turn_ = (turn_ + 1) % cameras_.size();
    if (!cameras_[turn_]->more()) continue;
    auto event = cameras_[turn_]->next(Duration(0));
    if (!event || !*event) {
      if (!event) return event;
      continue;
    }
    auto* sample = std::get_if<Sample>(&**event);
    auto* frame = sample != nullptr ? std::get_if<CameraFrame>(sample) : nullptr;
    if (frame == nullptr || move_to_robots_clock(*frame)) return event;
  }
  return std::optional<RobotEvent>();
}

Result<std::optional<RobotEvent>> RobotWithCameras::next(Duration most) {
  const Duration deadline = steady_now() + most;
  while (true) {
    if (!robot_.more()) {
      auto event = of_cameras();
      if (!event || *event) return event;
    }
    const Duration left = std::max(Duration(0), deadline - steady_now());
    auto event = robot_.next(std::min(kRobotSlice, left));
    if (event && *event && replaced(**event)) event = std::optional<RobotEvent>();
    if (!event || *event || steady_now() >= deadline) return event;
  }
}

}  // namespace waymark

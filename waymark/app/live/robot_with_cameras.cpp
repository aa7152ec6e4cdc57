#include "waymark/app/live/robot_with_cameras.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr Duration kRobotSlice = std::chrono::milliseconds(2);  // a picture waits no longer for the robot
constexpr Duration kMostAge = std::chrono::seconds(1);  // of a picture, as of all messages (StampGate)

}  // namespace

bool RobotWithCameras::more() const {
  return robot_.more() || std::ranges::any_of(cameras_, [](const auto& camera) { return camera->more(); });
}

/// Stamps of one camera grow also where the estimate of the robot's clock is moved back.
bool RobotWithCameras::move_to_robots_clock(CameraFrame& frame) {
  const auto now = robot_.now();
  const Duration age = steady_now() - frame.stamp.time_since_epoch();
  if (!now || age > kMostAge) return false;
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

Result<std::optional<RobotEvent>> RobotWithCameras::hear_robot(Duration most) {
  auto event = robot_.next(most);
  if (event && *event && replaced(**event)) event = std::optional<RobotEvent>();
  return event;
}

Result<std::optional<RobotEvent>> RobotWithCameras::next(Duration most) {
  const Duration deadline = steady_now() + most;
  // The robot first: a camera that always has a picture, because it takes longer to look at one than to take
  // it, must not keep the robot from being heard.
  auto event = hear_robot(Duration(0));
  while (event && !*event) {
    if (!robot_.more()) event = of_cameras();
    if (!event || *event || steady_now() >= deadline) break;
    event = hear_robot(std::min(kRobotSlice, std::max(Duration(0), deadline - steady_now())));
  }
  return event;
}

}  // namespace waymark

#include "waymark/robots/simulated/simulated_source.hpp"

#include <utility>
#include <variant>

namespace waymark {
namespace {

constexpr Duration kControlPeriod = std::chrono::milliseconds(50);

}  // namespace

Result<std::optional<RobotEvent>> SimulatedSource::next(Duration /*most*/) {
  if (std::exchange(asks_, false)) return std::optional<RobotEvent>(CommandRequest{robot_.now()});
  Sample sample = robot_.next();
  if (robot_.uptime() >= next_request_) {
    next_request_ += kControlPeriod;
    asks_ = true;
  }
  if (auto* picture = std::get_if<CameraFrame>(&sample); picture != nullptr && scene_camera_) {
    auto taken = scene_camera_->take(robot_.shot());
    if (!taken) return tl::unexpected(taken.error());
    picture->image = std::move(taken->image);
  }
  return std::optional<RobotEvent>(std::move(sample));
}

}  // namespace waymark

#include "waymark/simulation/robot/scripted_driver.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace waymark {

ScriptedDriver::ScriptedDriver(std::vector<PathPoint> path, bool closed, const DriverOptions& options,
                               Random random)
    : path_(std::move(path)), closed_(closed), options_(options), random_(random) {
  done_ = path_.size() < 3;
}

/// The nearest point only ever moves forward, so the path may cross itself.
void ScriptedDriver::advance(const SE2& map_T_base) {
  const double step = path_[1].arc_length_m;
  const auto distance = [&](std::size_t i) {
    return (path_[i].map_T_path.translation() - map_T_base.translation()).norm();
  };
  while (!done_) {
    const bool at_end = nearest_ + 1 == path_.size();
    const std::size_t next = at_end ? 0 : nearest_ + 1;
    if ((at_end && !closed_) || distance(next) > distance(nearest_)) break;
    nearest_ = next;
    driven_m_ += step;
    const double lap = step * static_cast<double>(path_.size());
    done_ = closed_ && driven_m_ >= lap + options_.overlap_m;
  }
  if (!closed_ && nearest_ + 1 == path_.size()) done_ = true;
}

VelocityCommand ScriptedDriver::drive(const SE2& map_T_base, SensorTime now) {
  if (!done_) advance(map_T_base);
  if (done_) return {};
  const double dt_s = last_ == SensorTime{} ? 0 : std::max(0.0, to_seconds(now - last_));
  last_ = std::max(last_, now);
  const double keep = std::exp(-dt_s / options_.wander_time_s);
  const double fresh = std::sqrt(1 - keep * keep);
  offset_ = keep * offset_ + fresh * random_.normal();
  haste_ = keep * haste_ + fresh * random_.normal();

  const double step = path_[1].arc_length_m;
  const std::size_t ahead = nearest_ + static_cast<std::size_t>(std::lround(options_.look_ahead_m / step));
  const SE2& target = path_[closed_ ? ahead % path_.size() : std::min(ahead, path_.size() - 1)].map_T_path;
  const Eigen::Vector2d map_goal = target * Eigen::Vector2d(0, options_.lateral_wander_m * offset_);
  const Eigen::Vector2d base_goal = map_T_base.inverse() * map_goal;
  const double curvature = 2 * base_goal.y() / std::max(base_goal.squaredNorm(), 1e-6);
  const bool second = options_.second_speed_m_s > 0 && std::fmod(driven_m_ / options_.alternate_m, 2) >= 1;
  const double meant = second ? options_.second_speed_m_s : options_.speed_m_s;
  const double speed = meant * std::clamp(1 + options_.speed_wander * haste_, 0.5, 1.5);
  return {speed, speed * curvature};
}

}  // namespace waymark

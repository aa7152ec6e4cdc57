#include "python/bindings/simulator.hpp"

#include <cmath>

#include <fmt/format.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark::python {
namespace {

constexpr double kPathStep_m = 0.02;
constexpr double kMaxAdvance_s = 3600;

SE2 start_of(const World& world, const std::optional<SE2>& start) {
  if (start) return *start;
  const auto path = sample_path(world.path_m, world.path_closed, kPathStep_m);
  if (path.empty()) refuse("start", "the world has no path on which to start", "Pass start=SE2(x, y, yaw).");
  return path.front().map_T_path;
}

std::vector<MountedCamera> cameras_of(const RobotDescription& robot) {
  std::vector<MountedCamera> cameras{{robot.camera_name, robot.camera, robot.model.base_T_cam}};
  cameras.insert(cameras.end(), robot.more_cameras.begin(), robot.more_cameras.end());
  return cameras;
}

}  // namespace

Simulator::Simulator(const World& world, const RobotDescription& robot, const SimulatedRobotOptions& options,
                     bool images, const std::optional<SE2>& start) {
  const std::vector<MountedCamera> cameras = cameras_of(robot);
  robot_ = std::make_unique<SimulatedRobot>(world, robot.model, cameras, start_of(world, start), options,
                                            images ? CameraOutput::Shots : CameraOutput::Corners);
  if (images) camera_ = value_of(DetectingCamera::make(std::make_shared<const World>(world), cameras, {}));
}

Sample Simulator::next() {
  Result<RenderedFrame> taken;
  Sample sample;
  {
    const py::gil_scoped_release release;
    const std::scoped_lock lock(mutex_);
    sample = robot_->next();
    auto* frame = std::get_if<CameraFrame>(&sample);
    if (frame == nullptr || !camera_) return sample;
    taken = camera_->take(robot_->shot());
  }
  std::get<CameraFrame>(sample).image = value_of(std::move(taken)).image;
  return sample;
}

std::vector<Sample> Simulator::advance(double seconds) {
  if (!(seconds >= 0 && seconds <= kMaxAdvance_s))
    refuse("seconds", fmt::format("{} s is outside [0, {}]", seconds, kMaxAdvance_s));
  const std::int64_t end = now_ns() + std::llround(seconds * 1e9);
  std::vector<Sample> samples;
  while (now_ns() < end) samples.push_back(next());
  return samples;
}

void Simulator::command(double speed_m_s, double yaw_rate_rad_s) {
  const VelocityCommand wanted{finite(speed_m_s, "speed_m_s"), finite(yaw_rate_rad_s, "yaw_rate_rad_s")};
  const std::scoped_lock lock(mutex_);
  check(robot_->command(wanted));
}

std::int64_t Simulator::now_ns() const {
  const std::scoped_lock lock(mutex_);
  return robot_->now().time_since_epoch().count();
}

SE2 Simulator::truth() const {
  const std::scoped_lock lock(mutex_);
  return robot_->true_map_T_base();
}

}  // namespace waymark::python

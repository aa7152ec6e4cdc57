#include "waymark/drivers/simulated/simulated_robot.hpp"

#include <cmath>
#include <utility>

#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

constexpr Duration kStep = std::chrono::milliseconds(5);

Duration period(double rate_hz) { return Duration(std::llround(1e9 / rate_hz)); }

}  // namespace

bool SimulatedRobot::Timer::due(SensorTime now) {
  if (now < next) return false;
  next += period;
  return true;
}

SimulatedRobot::SimulatedRobot(World world, RobotModel model, CameraModel camera, const SE2& map_T_base,
                               const SimulatedRobotOptions& options)
    : world_(std::move(world)),
      model_(std::move(model)),
      camera_(std::move(camera)),
      options_(options),
      random_(options.seed),
      dynamics_(model_, options.dynamics, map_T_base, random_.fork()),
      sensors_(model_, options.sensors, random_.fork()),
      camera_timer_{period(options.camera_rate_hz)},
      odometry_timer_{period(options.odometry_rate_hz)},
      imu_timer_{period(options.imu_rate_hz)},
      truth_timer_{period(options.truth_rate_hz)} {}

void SimulatedRobot::speak() {
  const SensorTime now = dynamics_.now();
  if (truth_timer_.due(now)) ready_.emplace_back(TruthPose{now, lift(dynamics_.map_T_base())});
  if (imu_timer_.due(now)) ready_.emplace_back(sensors_.read_imu(dynamics_));
  if (odometry_timer_.due(now)) {
    ready_.emplace_back(sensors_.read_wheels(dynamics_));
    ready_.emplace_back(sensors_.read_odometry(dynamics_));
  }
  if (camera_timer_.due(now)) {
    const SE3 map_T_cam = lift(dynamics_.map_T_base()) * model_.base_T_cam;
    ready_.emplace_back(see_tags(world_, camera_, map_T_cam, now, options_.tag_camera, random_));
  }
}

Result<std::optional<Sample>> SimulatedRobot::next() {
  while (ready_.empty()) {
    const bool fresh = to_seconds(dynamics_.now() - command_stamp_) <= options_.watchdog_s;
    dynamics_.step(fresh ? command_ : VelocityCommand{}, kStep);
    speak();
  }
  Sample sample = std::move(ready_.front());
  ready_.pop_front();
  return std::optional<Sample>(std::move(sample));
}

Status SimulatedRobot::command(const VelocityCommand& command) {
  command_ = command;
  command_stamp_ = dynamics_.now();
  return {};
}

}  // namespace waymark

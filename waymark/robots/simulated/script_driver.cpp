#include "waymark/robots/simulated/script_driver.hpp"

#include <utility>

#include "waymark/geometry/planar.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {

Result<std::unique_ptr<LapDriver>> ScriptDriver::make(const SimulatedSetup& setup, double speed_m_s) {
  constexpr double kPathStep_m = 0.02;
  constexpr std::uint64_t kScriptSeed = 1000;
  const auto path = sample_path(setup.world.path_m, setup.world.path_closed, kPathStep_m);
  if (path.size() < 3)
    return fail(ErrorCode::InvalidArgument, "the scripted driver requires a world with a line to drive",
                {.key = "driver"}, "Set `world`, or drive by hand: `driver=keyboard` or gamepad.");
  return std::make_unique<ScriptDriver>(ScriptedDriver(path, setup.world.path_closed,
                                                       DriverOptions{.speed_m_s = speed_m_s},
                                                       Random(setup.robot.seed + kScriptSeed)));
}

void ScriptDriver::receive(const Sample& sample) {
  const auto* truth = std::get_if<TruthPose>(&sample);
  if (truth != nullptr && !tracked_) map_T_base_ = project_to_plane(truth->map_T_base);
}

void ScriptDriver::see(const SE2& map_T_base) {
  tracked_ = true;
  map_T_base_ = map_T_base;
}

Result<DriverDecision> ScriptDriver::drive(Duration uptime, SensorTime now) {
  if (!map_T_base_) {
    constexpr Duration kPatience = std::chrono::seconds(5);
    if (uptime > kPatience)
      return fail(ErrorCode::NotFound, "the robot sends no ground truth, which the scripted driver requires",
                  {.key = "driver"}, "Drive by hand: `driver=keyboard` or gamepad.");
    return DriverDecision{};
  }
  const VelocityCommand command = script_.drive(*map_T_base_, tracked_ ? SensorTime(uptime) : now);
  return DriverDecision{.command = command, .done = script_.done()};
}

}  // namespace waymark

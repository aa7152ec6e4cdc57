#include "waymark/cli/live_driver.hpp"

#include "waymark/geometry/planar.hpp"
#include "waymark/simulation/path.hpp"

namespace waymark::cli {

Result<std::unique_ptr<LiveDriver>> LiveDriver::make(const std::string& name, double speed_m_s,
                                                     const SimulatedStage& stage) {
  std::unique_ptr<LiveDriver> driver(new LiveDriver);
  if (name != "scripted") {
    auto human = HumanDriver::make(name, speed_m_s);
    if (!human) return tl::unexpected(human.error());
    driver->human_ = std::move(*human);
    return driver;
  }
  constexpr double kPathStep_m = 0.02;
  constexpr std::uint64_t kScriptSeed = 1000;
  const auto path = sample_path(stage.world.path_m, stage.world.path_closed, kPathStep_m);
  if (path.size() < 3)
    return fail(ErrorCode::InvalidArgument, "a script needs to know the world and its line",
                {.key = "--driver"}, "Give --world, or let a person drive: --driver keyboard or gamepad.");
  driver->script_.emplace(path, stage.world.path_closed, DriverOptions{.speed_m_s = speed_m_s},
                          Random(stage.robot.seed + kScriptSeed));
  return driver;
}

void LiveDriver::hear(const Sample& sample) {
  if (const auto* truth = std::get_if<TruthPose>(&sample)) map_T_base_ = project_to_plane(truth->map_T_base);
}

Result<DriverDecision> LiveDriver::drive(Duration uptime, SensorTime now) {
  if (human_) return human_->drive(uptime, now);
  if (!map_T_base_) {
    constexpr Duration kPatience = std::chrono::seconds(5);
    if (uptime > kPatience)
      return fail(ErrorCode::NotFound, "the robot does not say where it truly is, so no script can drive it",
                  {.key = "--driver"}, "Let a person drive: --driver keyboard or gamepad.");
    return DriverDecision{};
  }
  const VelocityCommand command = script_->drive(*map_T_base_, now);
  return DriverDecision{.command = command, .done = script_->done()};
}

}  // namespace waymark::cli

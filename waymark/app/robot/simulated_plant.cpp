#include "waymark/app/robot/simulated_plant.hpp"

#include <utility>

#include "waymark/robots/simulated/simulated_robot.hpp"

namespace waymark {
namespace {

class SimulatedPlant final : public Plant {
 public:
  SimulatedPlant(const SimulatedSetup& setup, const SE2& map_T_base,
                 std::unique_ptr<DetectingCamera> scene_camera)
      : robot_(setup.world, setup.model, setup.cameras(), map_T_base, setup.robot,
               scene_camera != nullptr ? CameraOutput::Shots : CameraOutput::Corners),
        scene_camera_(std::move(scene_camera)) {}

  Result<Sample> next() override {
    Sample sample = robot_.next();
    if (auto* frame = std::get_if<CameraFrame>(&sample)) {
      auto taken = scene_camera_->take(robot_.shot());
      if (!taken) return tl::unexpected(taken.error());
      frame->image = std::move(taken->image);
    }
    return sample;
  }
  Status command(const VelocityCommand& command) override { return robot_.command(command); }
  [[nodiscard]] SensorTime now() const override { return robot_.now(); }
  [[nodiscard]] Duration uptime() const override { return robot_.uptime(); }

 private:
  SimulatedRobot robot_;
  std::unique_ptr<DetectingCamera> scene_camera_;
};

}  // namespace

Result<std::unique_ptr<Plant>> make_simulated_plant(const SimulatedSetup& setup, const SE2& map_T_base) {
  std::unique_ptr<DetectingCamera> scene_camera;
  if (setup.pictures) {
    auto made =
        DetectingCamera::make(std::make_shared<const World>(setup.world), setup.cameras(), *setup.pictures);
    if (!made) return tl::unexpected(made.error());
    scene_camera = std::move(*made);
  }
  return std::make_unique<SimulatedPlant>(setup, map_T_base, std::move(scene_camera));
}

}  // namespace waymark

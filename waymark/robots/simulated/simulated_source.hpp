#pragma once

#include <memory>

#include "waymark/robots/simulated/detecting_camera.hpp"
#include "waymark/robots/simulated/simulated_robot.hpp"
#include "waymark/samples/robot.hpp"

namespace waymark {

/// The samples of a simulated robot, which asks for a command twenty times a second of its own time and waits
/// for it.
class SimulatedSource final : public Source {
 public:
  /// The robot outlives it. `scene_camera`: takes the pictures; without it CameraFrames have none, and
  /// SimulatedRobot::shot() says how to take the last one.
  explicit SimulatedSource(SimulatedRobot& robot, std::unique_ptr<DetectingCamera> scene_camera = nullptr)
      : robot_(robot), scene_camera_(std::move(scene_camera)) {}

  /// Never waits and never ends: the simulated world goes on.
  Result<std::optional<RobotEvent>> next(Duration most) override;
  [[nodiscard]] bool more() const override { return true; }
  [[nodiscard]] std::optional<SensorTime> now() const override { return robot_.now(); }

 private:
  SimulatedRobot& robot_;
  std::unique_ptr<DetectingCamera> scene_camera_;
  Duration next_request_{};
  bool asks_ = false;
};

}  // namespace waymark

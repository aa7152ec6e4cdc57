#pragma once

#include <cstdint>
#include <deque>

#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/simulation/motion_sensors.hpp"
#include "waymark/simulation/robot_dynamics.hpp"
#include "waymark/simulation/tag_camera.hpp"
#include "waymark/simulation/world.hpp"

namespace waymark {

struct SimulatedRobotOptions {
  std::uint64_t seed = 1;
  double camera_rate_hz = 15;
  double odometry_rate_hz = 50;
  double imu_rate_hz = 100;
  double truth_rate_hz = 50;
  double watchdog_s = 0.25;
  DynamicsOptions dynamics{};
  MotionSensorOptions sensors{};
  TagCameraOptions tag_camera{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.camera_rate_hz, Field{"camera_rate_hz", "Frames a second.", 0.1, 200});
    visit(self.odometry_rate_hz, Field{"odometry_rate_hz", "Odometry and wheels, times a second.", 1, 200});
    visit(self.imu_rate_hz, Field{"imu_rate_hz", "IMU, times a second.", 1, 200});
    visit(self.truth_rate_hz, Field{"truth_rate_hz", "True pose, times a second.", 1, 200});
    visit(self.watchdog_s,
          Field{"watchdog_s", "The robot stops by itself when no command came for this long.", 0.01, 10});
  }
};

/// A robot in a world. next() lets the time pass until the next sensor speaks; command() acts from then on.
class SimulatedRobot final : public Source, public Robot {
 public:
  SimulatedRobot(World world, RobotModel model, CameraModel camera, const SE2& map_T_base,
                 const SimulatedRobotOptions& options);

  /// Never ends: the simulated world goes on.
  Result<std::optional<Sample>> next() override;
  Status command(const VelocityCommand& command) override;

  [[nodiscard]] SensorTime now() const { return dynamics_.now(); }
  /// For a driver who stands beside the robot; never for an estimator.
  [[nodiscard]] const SE2& true_map_T_base() const { return dynamics_.map_T_base(); }

 private:
  /// A sensor that speaks at even times.
  struct Timer {
    Duration period{};
    SensorTime next{};
    bool due(SensorTime now);
  };
  void speak();

  World world_;
  RobotModel model_;
  CameraModel camera_;
  SimulatedRobotOptions options_;
  Random random_;
  RobotDynamics dynamics_;
  MotionSensors sensors_;
  Timer camera_timer_;
  Timer odometry_timer_;
  Timer imu_timer_;
  Timer truth_timer_;
  std::deque<Sample> ready_;
  VelocityCommand command_{};
  SensorTime command_stamp_{};
};

}  // namespace waymark

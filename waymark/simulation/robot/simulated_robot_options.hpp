#pragma once

#include <cstdint>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/simulation/robot/faults.hpp"
#include "waymark/simulation/robot/robot_dynamics.hpp"
#include "waymark/simulation/sensors/lidar.hpp"
#include "waymark/simulation/sensors/motion_sensors.hpp"
#include "waymark/simulation/sensors/tag_camera.hpp"

namespace waymark {

/// All parameters of a simulated robot, except its body and its cameras.
struct SimulatedRobotOptions {
  std::uint64_t seed = 1;
  double camera_rate_hz = 15;
  /// Delivery delay: the timestamp is exact, but the frame arrives later. The member is named after the YAML
  /// key.
  double camera_latency_s = 0;
  double odometry_rate_hz = 50;
  double imu_rate_hz = 100;
  double truth_rate_hz = 50;
  double watchdog_s = 0.25;
  DynamicsOptions dynamics{};
  MotionSensorOptions sensors{};
  TagCameraOptions tag_camera{};
  LidarOptions lidar{};
  std::vector<Fault> faults{};  ///< scripted faults; not a field, because they are stored in a separate file

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.camera_rate_hz, Field{"camera_rate_hz", "Frames per second of the camera.", 0.1, 200});
    visit(self.camera_latency_s,
          Field{"camera_latency_s",
                "Camera latency: time from the middle of the exposure to the delivery of the frame.", 0, 10});
    visit(self.odometry_rate_hz, Field{"odometry_rate_hz", "Rate of odometry and wheel samples.", 1, 200});
    visit(self.imu_rate_hz, Field{"imu_rate_hz", "Rate of IMU samples.", 1, 200});
    visit(self.truth_rate_hz, Field{"truth_rate_hz", "Rate of true poses.", 1, 200});
    visit(self.watchdog_s,
          Field{"watchdog_s", "Time without a command after which the robot stops by itself.", 0.01, 10});
    visit(self.dynamics, Field{"dynamics", "Dynamics of the robot."});
    visit(self.sensors, Field{"sensors", "Noise and errors of wheels, IMU and odometry."});
    visit(self.tag_camera,
          Field{"tag_camera", "Combined camera and detector, which returns corners without images."});
    visit(self.lidar, Field{"lidar", "Planar lidar."});
  }
};

/// Fails if a number is out of range or a word is unknown; the error contains the name of the field.
[[nodiscard]] Status check(const SimulatedRobotOptions& options);

}  // namespace waymark

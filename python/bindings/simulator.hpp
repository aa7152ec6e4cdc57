#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/simulated/detecting_camera.hpp"
#include "waymark/robots/simulated/simulated_robot.hpp"

namespace waymark::python {

/// A simulated robot polled from Python. Threads are serialised with a mutex; the GIL is released while the
/// robot moves.
class Simulator {
 public:
  Simulator(const World& world, const RobotDescription& robot, const SimulatedRobotOptions& options,
            bool images, const std::optional<SE2>& start);

  Sample next();
  std::vector<Sample> advance(double seconds);
  void command(double speed_m_s, double yaw_rate_rad_s);
  [[nodiscard]] std::int64_t now_ns() const;
  [[nodiscard]] SE2 truth() const;

 private:
  mutable std::mutex mutex_;  ///< its holder never waits for the GIL
  std::unique_ptr<SimulatedRobot> robot_;
  std::unique_ptr<DetectingCamera> camera_;
};

}  // namespace waymark::python

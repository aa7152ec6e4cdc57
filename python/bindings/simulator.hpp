#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/config/robot_file.hpp"
#include "waymark/drivers/simulated/detecting_camera.hpp"
#include "waymark/drivers/simulated/simulated_robot.hpp"

namespace waymark::python {

/// A simulated robot that Python asks for its samples. One thread at a time, which the GIL sees to.
class Simulator {
 public:
  Simulator(const World& world, const RobotDescription& robot, const SimulatedRobotOptions& options,
            bool pictures, const std::optional<SE2>& start);

  Sample next();
  std::vector<Sample> advance(double seconds);
  void command(double speed_m_s, double yaw_rate_rad_s);
  [[nodiscard]] std::int64_t now_ns() const { return robot_->now().time_since_epoch().count(); }
  [[nodiscard]] SE2 truth() const { return robot_->true_map_T_base(); }

 private:
  std::unique_ptr<SimulatedRobot> robot_;
  std::unique_ptr<DetectingCamera> camera_;
};

}  // namespace waymark::python

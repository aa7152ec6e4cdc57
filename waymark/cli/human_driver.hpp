#pragma once

#include <memory>
#include <string>

#include "waymark/runtime/robot_loop.hpp"

namespace waymark::cli {

/// A person who drives with keys or a gamepad: the simulated time then passes as fast as the real one.
class HumanDriver {
 public:
  /// "keyboard" or "gamepad". Fails without a terminal, without a pad.
  [[nodiscard]] static Result<std::unique_ptr<HumanDriver>> make(const std::string& name, double speed_m_s);
  virtual ~HumanDriver() = default;
  HumanDriver(const HumanDriver&) = delete;
  HumanDriver& operator=(const HumanDriver&) = delete;

  /// What it decides now; waits until the clock on the wall is as far as the robot's.
  [[nodiscard]] Result<DriverDecision> drive(Duration uptime, SensorTime now);
  /// How to drive, in one line.
  [[nodiscard]] virtual std::string usage() const = 0;

 protected:
  HumanDriver() = default;
  [[nodiscard]] virtual Result<DriverDecision> decide(Duration uptime, SensorTime now) = 0;

 private:
  std::int64_t start_ns_ = 0;
};

}  // namespace waymark::cli

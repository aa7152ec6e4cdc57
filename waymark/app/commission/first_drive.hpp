#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "waymark/app/commission/commission.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/runtime/commission_motion.hpp"

namespace waymark {

inline constexpr VelocityCommand kFirstForward{.speed_m_s = 0.1, .yaw_rate_rad_s = 0};
inline constexpr VelocityCommand kFirstTurn{.speed_m_s = 0, .yaw_rate_rad_s = 0.4};

/// The steps of commission(), one after the other. Each adds what it found; an error means that the next one
/// cannot be taken.
class FirstDrive {
 public:
  FirstDrive(const RobotSetup& setup, const CommissionJob& job, const CommissionPerson& person,
             const JobControl& control);

  /// With the wheels in the air: forward, left.
  Status drive_lifted();
  /// 0.5 m, 90 degrees, 0.3 m.
  Status drive_on_floor();
  /// Of a real robot, or one in real time: `waymark stop`, no commands, a killed driver, no data.
  Status try_stops();

  [[nodiscard]] CommissionReport& report() { return report_; }

 private:
  Status open();
  Status wait_for(const std::string& words);
  Result<MotionTrace> drive(
      const MotionOptions& options, const std::string& words,
      const std::function<bool()>& ends = [] { return false; });
  void add(const std::string& step, std::vector<CommissionLine> lines);
  Status stop_by_request();
  Status stop_by_key();
  Status stop_by_silence();
  Status stop_by_kill();
  Status see_again(MotionTiming& timing);
  Status lose_data();

  const RobotSetup& setup_;
  const CommissionJob& job_;
  const CommissionPerson& person_;
  const JobControl& control_;
  TagWitness witness_{};
  std::unique_ptr<LiveRobot> robot_{};
  CommissionReport report_{};
};

}  // namespace waymark

#pragma once

#include <optional>
#include <string>

#include "waymark/runtime/commission_trace.hpp"
#include "waymark/runtime/robot_loop.hpp"

namespace waymark {

/// One motion of a first drive.
struct MotionOptions {
  VelocityCommand command{};
  double most_s = 2;       ///< of motion
  double way = 0;          ///< [m] or [rad] of the odometry after which it ends; 0: by time alone
  double least_s = 1.5;    ///< of motion, whatever the odometry says
  double far_m = 0.7;      ///< by the odometry: farther it never goes once least_s are over
  double before_s = 0.7;   ///< it stands so long first
  double after_s = 1.5;    ///< and is watched so long afterwards
  double silence_s = 0.5;  ///< without odometry for so long it ends
};

/// Drives one motion and keeps what was measured; zero before, after, and when odometry fails to come.
class CommissionMotion {
 public:
  CommissionMotion(const MotionOptions& options, const TagWitness& witness)
      : options_(options), witness_(witness) {
    trace_.commanded = options.command;
  }

  void receive(const Sample& sample);
  [[nodiscard]] Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// Ends the motion at the next decision, for a request to stop.
  void end_motion() { stop_asked_ = true; }
  [[nodiscard]] bool moving() const { return trace_.began && !trace_.ceased; }

  [[nodiscard]] const MotionTrace& trace() const { return trace_; }
  /// Longest time without odometry while this was driven [s].
  [[nodiscard]] double longest_silence_s() const { return longest_silence_s_; }

 private:
  [[nodiscard]] bool motion_over(SensorTime now) const;

  MotionOptions options_;
  TagWitness witness_;
  MotionTrace trace_{};
  std::optional<Duration> began_{};  ///< uptime of the first decision
  std::optional<Duration> heard_{};  ///< uptime of the decision after the newest odometry
  std::size_t counted_ = 0;          ///< odometry at the decision before
  std::size_t first_moving_ = 0;     ///< odometry when the motion began
  double longest_silence_s_ = 0;
  bool stop_asked_ = false;
};

}  // namespace waymark

#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/runtime/robot_loop.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {

/// Where a camera saw a tag from the robot.
struct TagPlace {
  SensorTime stamp{};
  TagId tag{};
  Eigen::Vector2d base_p_tag_m = Eigen::Vector2d::Zero();  ///< centre of the tag in base axes, on the floor
};

/// One motion of a first drive: what was commanded, and what was measured before, meanwhile and afterwards.
/// All stamps are of the robot's clock.
struct MotionTrace {
  VelocityCommand commanded{};         ///< of the motion; zero before and after it
  std::optional<SensorTime> began{};   ///< when it was commanded first
  std::optional<SensorTime> ceased{};  ///< when zero was commanded, or the commands ceased
  std::vector<Odometry> odometry{};
  std::vector<WheelTicks> wheels{};
  std::vector<ImuSample> imu{};
  std::vector<TagPlace> tags{};
};

/// The cameras of a robot, and how large the tags before them are.
struct TagWitness {
  std::vector<MountedCamera> cameras{};
  TagSizes sizes{};  ///< empty: tags say nothing
};

/// Adds a sample. Tags are placed by their corners (the better of the two poses of a square) where camera and
/// size are known; samples that are of no use here are passed over.
void receive(MotionTrace& trace, const Sample& sample, const TagWitness& witness);

/// The part of a trace in which a motion was steady: from `settle_s` after it was commanded to its end. Empty
/// where it was not commanded.
[[nodiscard]] MotionTrace steady_part(const MotionTrace& trace, double settle_s);
/// The part before it was commanded: the robot stood.
[[nodiscard]] MotionTrace standing_part(const MotionTrace& trace);

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
  std::optional<Duration> began_{};          ///< uptime of the first decision
  std::optional<Duration> last_odometry_{};  ///< uptime of the decision after the newest odometry
  std::size_t counted_ = 0;                  ///< odometry at the decision before
  std::size_t first_moving_ = 0;             ///< odometry when the motion began
  double longest_silence_s_ = 0;
  bool stop_asked_ = false;
};

}  // namespace waymark

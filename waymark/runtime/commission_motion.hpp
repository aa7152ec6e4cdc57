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

/// Position of a tag relative to the robot, as observed by a camera.
struct TagPlace {
  SensorTime stamp{};
  TagId tag{};
  Eigen::Vector2d base_p_tag_m = Eigen::Vector2d::Zero();  ///< centre of the tag in the base frame, projected
                                                           ///< to the floor
};

/// One motion during a first drive: the command, and the samples before, during and after it. All timestamps
/// are on the robot's clock.
struct MotionTrace {
  VelocityCommand commanded{};         ///< command during the motion; zero before and after it
  std::optional<SensorTime> began{};   ///< time of the first command
  std::optional<SensorTime> ceased{};  ///< time at which zero was commanded or the commands ended
  std::vector<Odometry> odometry{};
  std::vector<WheelTicks> wheels{};
  std::vector<ImuSample> imu{};
  std::vector<TagPlace> tags{};
};

/// The cameras of a robot and the sizes of the tags that they observe.
struct TagWitness {
  std::vector<MountedCamera> cameras{};
  TagSizes sizes{};  ///< tags are not evaluated if empty
};

/// Adds a sample. If the camera and the tag size are known, the position of a tag is computed from its
/// corners (using the better of the two poses of a square). Samples that are not needed are ignored.
void receive(MotionTrace& trace, const Sample& sample, const TagWitness& witness);

/// The steady part of a trace, from `settle_s` after the command until the end of the motion. Empty without a
/// command.
[[nodiscard]] MotionTrace steady_part(const MotionTrace& trace, double settle_s);
/// The part before the command, when the robot is stationary.
[[nodiscard]] MotionTrace standing_part(const MotionTrace& trace);

/// Parameters for one motion of a first drive.
struct MotionOptions {
  VelocityCommand command{};
  double most_s = 2;       ///< maximum duration of the motion
  double way = 0;          ///< [m] or [rad] measured by odometry, after which the motion ends; if 0, it ends
                           ///< by time alone
  double least_s = 1.5;    ///< minimum duration, regardless of odometry
  double far_m = 0.7;      ///< maximum distance measured by odometry, once least_s has elapsed
  double before_s = 0.7;   ///< how long the robot stands still before the motion
  double after_s = 1.5;    ///< how long the robot is observed afterwards
  double silence_s = 0.5;  ///< time without odometry after which the motion ends
};

/// Drives one motion and records its samples. Commands zero before and after it, and if odometry fails.
class CommissionMotion {
 public:
  CommissionMotion(const MotionOptions& options, const TagWitness& witness)
      : options_(options), witness_(witness) {
    trace_.commanded = options.command;
  }

  void receive(const Sample& sample);
  [[nodiscard]] Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// Ends the motion at the next decision. Called when a stop is requested.
  void end_motion() { stop_asked_ = true; }
  [[nodiscard]] bool moving() const { return trace_.began && !trace_.ceased; }

  [[nodiscard]] const MotionTrace& trace() const { return trace_; }
  /// The longest time without odometry during the motion [s].
  [[nodiscard]] double longest_silence_s() const { return longest_silence_s_; }

 private:
  [[nodiscard]] bool motion_over(SensorTime now) const;

  MotionOptions options_;
  TagWitness witness_;
  MotionTrace trace_{};
  std::optional<Duration> began_{};          ///< uptime of the first decision
  std::optional<Duration> last_odometry_{};  ///< uptime at the first decision after the newest odometry
  std::size_t counted_ = 0;                  ///< number of odometry samples at the previous decision
  std::size_t first_moving_ = 0;             ///< number of odometry samples when the motion started
  double longest_silence_s_ = 0;
  bool stop_asked_ = false;
};

}  // namespace waymark

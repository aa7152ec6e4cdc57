#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

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

}  // namespace waymark

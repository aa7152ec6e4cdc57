#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Where the robot is believed to be.
struct LocalizationEstimate {
  SensorTime stamp{};
  SE2 map_T_base{};
  /// Of (x, y, yaw) in ordinary map coordinates [m, rad].
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  /// The larger standard deviation of the position in the plane [m].
  [[nodiscard]] double position_sigma_m() const;
};

/// A way to know where the robot is. Samples in stamp order; no method looks at TruthPose.
class LocalizationMethod {
 public:
  virtual ~LocalizationMethod() = default;
  LocalizationMethod(const LocalizationMethod&) = delete;
  LocalizationMethod& operator=(const LocalizationMethod&) = delete;

  virtual void add(const TagFrame& frame) = 0;
  virtual void add(const Odometry& odometry) = 0;
  /// The newest estimate; nothing before the first fix.
  [[nodiscard]] virtual std::optional<LocalizationEstimate> estimate() const = 0;

 protected:
  LocalizationMethod() = default;
};

}  // namespace waymark

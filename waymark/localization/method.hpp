#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// An estimate of the robot's pose.
struct LocalizationEstimate {
  SensorTime stamp{};
  SE2 map_T_base{};
  /// Covariance of (x, y, yaw) in map coordinates [m, rad].
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// If false, the estimate is contradicted by observations or not yet confirmed by enough of them, and must
  /// not be used for driving.
  bool certain = true;
  /// Number of consecutive frames, up to the newest, in which most observations contradict the estimate. 0 if
  /// the newest frame agrees, or if the method does not detect contradictions.
  int contradicting_frames = 0;

  /// The larger standard deviation of the position in the plane [m], that is, the square root of the larger
  /// eigenvalue of the covariance of (x, y).
  [[nodiscard]] double position_sigma_m() const;
};

/// One observation compared with its prediction.
struct NisRecord {
  SensorTime stamp{};
  TagId tag{};
  double nis = 0;         ///< normalised innovation squared
  int rows = 0;           ///< degrees of freedom
  bool accepted = false;  ///< whether it passed the gate and was used
  double log_det = 0;     ///< logarithm of the determinant of the whitened innovation's covariance
};

/// Pose of the robot from the tags in a single image, independent of motion and earlier images.
struct TagFix {
  SensorTime stamp{};
  SE2 map_T_base{};
  /// Covariance of (x, y, yaw) in map coordinates [m, rad], without the errors that nearby tags have in
  /// common.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  int tags = 0;
};

/// A pose of the robot that comes from outside the filter, such as from an operator.
struct GivenPose {
  SE2 map_T_base{};
  /// Covariance of (x, y, yaw) in map coordinates [m, rad]; positive definite.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

class RiekfLocalizer;

/// Interface of the localization methods. Samples are added in stamp order; no method reads TruthPose.
class LocalizationMethod {
 public:
  virtual ~LocalizationMethod() = default;
  LocalizationMethod(const LocalizationMethod&) = delete;
  LocalizationMethod& operator=(const LocalizationMethod&) = delete;

  virtual void add(const TagFrame& frame) = 0;
  virtual void add(const Odometry& odometry) = 0;
  virtual void add(const ImuSample& /*imu*/) {}
  virtual void add(const TagPoseFrame& /*frame*/) {}
  virtual void add(const RangeBearing& /*seen*/) {}
  /// The latest estimate; empty before the first fix.
  [[nodiscard]] virtual std::optional<LocalizationEstimate> estimate() const = 0;
  /// comparisons() returns the observations that have been compared with the estimate since
  /// clear_comparisons(). problems() returns findings for the user as text.
  [[nodiscard]] virtual const std::vector<NisRecord>& comparisons() const {
    static const std::vector<NisRecord> kNone;
    return kNone;
  }
  virtual void clear_comparisons() {}
  /// Sets the pose at power-on, with the standard deviations of x and y [m] and of the heading [rad]. Methods
  /// that always initialise from tags ignore it.
  virtual void start_from(const SE2& /*map_T_base*/, double /*sigma_m*/, double /*sigma_rad*/) {}
  /// Replaces the estimate with a given pose. It is reported as certain again once the first tags agree, and
  /// dropped as soon as they do not. Returns false if the method takes its pose only from tags.
  virtual bool restart_from(const GivenPose& /*given*/) { return false; }
  /// The filter that this method is or uses; nullptr if there is none.
  [[nodiscard]] virtual RiekfLocalizer* filter() { return nullptr; }
  /// Fix from the newest image; empty if its tags are not sufficient or the method does not compute fixes.
  [[nodiscard]] virtual std::optional<TagFix> tag_fix() const { return std::nullopt; }
  [[nodiscard]] virtual std::vector<std::string> problems() const { return {}; }

 protected:
  LocalizationMethod() = default;
};

}  // namespace waymark

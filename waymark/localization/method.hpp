#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Estimated pose of the robot.
struct LocalizationEstimate {
  SensorTime stamp{};
  SE2 map_T_base{};
  /// Of (x, y, yaw) in ordinary map coordinates [m, rad].
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// False: a guess. What is seen contradicts it, or does not suffice; nothing should drive by it.
  bool certain = true;
  /// Looks in a row, up to the newest, most of which contradict it; 0 when the newest agrees. A method that
  /// cannot tell says 0.
  int contradicting_frames = 0;

  /// The larger standard deviation of the position in the plane [m].
  [[nodiscard]] double position_sigma_m() const;
};

/// One observation beside what was expected of it.
struct NisRecord {
  SensorTime stamp{};
  TagId tag{};
  double nis = 0;         ///< normalised innovation squared
  int rows = 0;           ///< its degrees of freedom
  bool accepted = false;  ///< and used
  double log_det = 0;     ///< of the covariance of the whitened innovation
};

/// Where the robot is by the tags of one picture alone, whatever motion and earlier pictures say.
struct TagFix {
  SensorTime stamp{};
  SE2 map_T_base{};
  /// Of (x, y, yaw) in ordinary map coordinates [m, rad], without the errors that tags around share.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  int tags = 0;
};

/// Where somebody says that the robot is.
struct GivenPose {
  SE2 map_T_base{};
  /// Of (x, y, yaw) in ordinary map coordinates [m, rad]; positive definite.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

class RiekfLocalizer;

/// A way to know where the robot is. Samples in stamp order; no method looks at TruthPose.
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
  /// The newest estimate; nothing before the first fix.
  [[nodiscard]] virtual std::optional<LocalizationEstimate> estimate() const = 0;
  /// What was compared with the estimate since clear_comparisons(), and what a user must know, in words.
  [[nodiscard]] virtual const std::vector<NisRecord>& comparisons() const {
    static const std::vector<NisRecord> kNone;
    return kNone;
  }
  virtual void clear_comparisons() {}
  /// For a robot whose place is known when it is switched on, with standard deviations of x, y and of the
  /// heading; a method that always starts from tags does not use it.
  virtual void start_from(const SE2& /*map_T_base*/, double /*sigma_m*/, double /*sigma_rad*/) {}
  /// Somebody says where the robot is now, whatever was estimated before; certain again when the first tags
  /// agree, given up at once when they do not. False: the method takes its pose from tags alone.
  virtual bool restart_from(const GivenPose& /*given*/) { return false; }
  /// The filter that the method is or stands on; nullptr when there is none.
  [[nodiscard]] virtual RiekfLocalizer* filter() { return nullptr; }
  /// Of the newest picture; nothing when its tags do not suffice, or from a method that cannot tell.
  [[nodiscard]] virtual std::optional<TagFix> tag_fix() const { return std::nullopt; }
  [[nodiscard]] virtual std::vector<std::string> problems() const { return {}; }

 protected:
  LocalizationMethod() = default;
};

}  // namespace waymark

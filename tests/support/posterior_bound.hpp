#pragma once

#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark::testing {

/// True noise of the motion measurements of a drive, as standard deviations.
struct TrueNoise {
  double start_m = 0;       ///< of x and of y at the start of the filter
  double start_rad = 0;     ///< of yaw
  double scale = 0;         ///< of the distance, unknown but constant
  double bias_rad_s = 0;    ///< of the yaw rate, unknown but constant
  double slip_s = 0;        ///< lateral speed per speed and yaw rate, unknown but constant
  double slide_m_s = 0;     ///< lateral speed, a first-order Gauss-Markov process
  double slide_time_s = 1;  ///< its time constant
  double message_s = 0.02;  ///< interval of the odometry messages
  double gyro_rad = 0;      ///< of the turn, per square root of a second
  /// the translation is measured in the axes of frame odom, independent of the heading
  bool way_in_odom = false;
  double askew_rad = 0;  ///< of those axes relative to the heading at the start
  double walk_m = 0;     ///< of x and of y, per square root of a second
};

struct BoundAt {
  SensorTime stamp{};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of x, y, yaw: a lower bound for any estimator
};

/// The posterior Cramer-Rao bound along a drive, at each odometry message (Tichavsky, Muravchik and Nehorai,
/// "Posterior Cramer-Rao Bounds for Discrete-Time Nonlinear Filtering", IEEE TSP 46(5), 1998, eq. 21, in
/// covariance form because the noise of some states is zero, section IV). Derivatives at the true poses,
/// those of the corners by finite differences: shares no code with the filter.
[[nodiscard]] std::vector<BoundAt> posterior_bound(const std::vector<Sample>& samples,
                                                   const std::vector<TruthPose>& truth, const TagMap& map,
                                                   const CameraModel& camera, const SE3& base_T_cam,
                                                   const TrueNoise& noise);

}  // namespace waymark::testing

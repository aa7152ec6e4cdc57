#pragma once

#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark::testing {

/// How the motion of a drive was really measured; the standard deviation of each.
struct TrueNoise {
  double start_m = 0;        ///< of x and of y when the filter starts
  double start_rad = 0;      ///< of yaw
  double scale = 0;          ///< of the distance, unknown but constant
  double bias_rad_s = 0;     ///< of the yaw rate, unknown but constant
  double slip_s = 0;         ///< sideways speed per speed and yaw rate, unknown but constant
  double slide_m_s = 0;      ///< sideways speed, a first-order Gauss-Markov process
  double slide_time_s = 1;   ///< and its time constant
  double message_s = 0.02;   ///< from one message of odometry to the next
  double gyro_rad = 0;       ///< of the turn, per square root of a second
  bool way_in_odom = false;  ///< the way is measured in the axes of frame odom, whatever the heading says
  double askew_rad = 0;      ///< of those axes beside the heading at the start
  double walk_m = 0;         ///< of x and of y, per square root of a second
};

struct BoundAt {
  SensorTime stamp{};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of x, y, yaw: no estimator does better
};

/// The posterior Cramer-Rao bound along a drive, at each message of odometry (Tichavsky, Muravchik and
/// Nehorai, "Posterior Cramer-Rao Bounds for Discrete-Time Nonlinear Filtering", IEEE TSP 46(5), 1998,
/// eq. 21, by the covariance because the noise of some states is zero, section IV). Derivatives at the true
/// poses, those of the corners by differences: nothing here is the filter's.
[[nodiscard]] std::vector<BoundAt> posterior_bound(const std::vector<Sample>& samples,
                                                   const std::vector<TruthPose>& truth, const TagMap& map,
                                                   const CameraModel& camera, const SE3& base_T_cam,
                                                   const TrueNoise& noise);

}  // namespace waymark::testing

#pragma once

#include <Eigen/Core>

#include "waymark/geometry/se3.hpp"

namespace waymark {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix36 = Eigen::Matrix<double, 3, 6>;

/// L^-1 of a covariance L L^T, which whitens a residual with that covariance. N is 3 or 6. The covariance
/// must be positive definite.
[[nodiscard]] Matrix6 whitening_of(const Matrix6& covariance);
[[nodiscard]] Eigen::Matrix3d whitening_of(const Eigen::Matrix3d& covariance);

/// A prior on a pose, with residual W log(X prior^-1): the error in the parent frame of X.
struct PosePriorFactor {
  SE3 prior{};
  Matrix6 whitening = Matrix6::Identity();
};
[[nodiscard]] Vector6 pose_prior_residual(const PosePriorFactor& factor, const SE3& X,
                                          Matrix6* J_r_X = nullptr);

/// Correlated priors on two poses, with residual W (log(B prior_b^-1) - gain log(A prior_a^-1)), where W
/// whitens the covariance of B's error given A's.
struct PosePairPriorFactor {
  SE3 prior_a{}, prior_b{};
  Matrix6 gain = Matrix6::Zero();
  Matrix6 whitening = Matrix6::Identity();
};
[[nodiscard]] Vector6 pose_pair_prior_residual(const PosePairPriorFactor& factor, const SE3& A, const SE3& B,
                                               Matrix6* J_r_a = nullptr, Matrix6* J_r_b = nullptr);

/// The 3D motion M of a body from A to B, measured by a sensor at S = body_T_sensor. The residual is W log((A
/// S)^-1 B S M^-1), the error in the sensor's frame at A.
struct RelativePoseFactor {
  SE3 measured{};       ///< sensorA_T_sensorB
  SE3 body_T_sensor{};  ///< mounting pose of the sensor
  Matrix6 whitening = Matrix6::Identity();
};
[[nodiscard]] Vector6 relative_pose_residual(const RelativePoseFactor& factor, const SE3& map_T_a,
                                             const SE3& map_T_b, Matrix6* J_r_a = nullptr,
                                             Matrix6* J_r_b = nullptr);

/// A base on its floor. The residual contains the height of floor_T_base = map_T_floor^-1 map_T_base and the
/// tilts of its z axis, divided by their standard deviations. The tilts are the x and y components of the
/// base's z axis in floor axes.
struct OnFloorFactor {
  double height_sigma_m = 0.005;
  double tilt_sigma_rad = 0.005;
};
[[nodiscard]] Eigen::Vector3d on_floor_residual(const OnFloorFactor& factor, const SE3& map_T_floor,
                                                const SE3& map_T_base, Matrix36* J_r_floor = nullptr,
                                                Matrix36* J_r_base = nullptr);

/// A distance between the origins of two poses in one parent frame, with its standard deviation [m].
struct DistanceFactor {
  double measured_m = 0;
  double sigma_m = 0.01;
};
[[nodiscard]] double distance_residual(const DistanceFactor& factor, const SE3& a, const SE3& b,
                                       Eigen::Matrix<double, 1, 6>* J_r_a = nullptr,
                                       Eigen::Matrix<double, 1, 6>* J_r_b = nullptr);

/// The coordinate of a pose's origin along a direction in its parent frame.
struct CoordinateFactor {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< of unit length
  double measured_m = 0;
  double sigma_m = 0.01;
};
[[nodiscard]] double coordinate_residual(const CoordinateFactor& factor, const SE3& X,
                                         Eigen::Matrix<double, 1, 6>* J_r_X = nullptr);

/// A point on a tag that is mounted on a body, in the map frame: map_p = map_T_body body_T_tag tag_p.
struct TagPoint {
  Eigen::Vector3d map_p = Eigen::Vector3d::Zero();
  Matrix36 J_p_body = Matrix36::Zero();  ///< for left perturbations
  Matrix36 J_p_tag = Matrix36::Zero();
};
[[nodiscard]] TagPoint tag_point(const SE3& map_T_body, const SE3& body_T_tag, const Eigen::Vector3d& tag_p);

/// Residual of the distance between points on two tags, divided by its standard deviation. J_r_p is for the
/// first point; the Jacobian for the second is its negative.
[[nodiscard]] double point_distance_residual(double measured_m, double sigma_m,
                                             const Eigen::Vector3d& map_p_a, const Eigen::Vector3d& map_p_b,
                                             Eigen::RowVector3d* J_r_a = nullptr);

/// An axis of a tag that is parallel or antiparallel to a known direction in the map, both of unit length.
/// For example, an upright tag has its y axis along the map's z axis.
struct DirectionFactor {
  Eigen::Vector3d tag_axis = Eigen::Vector3d::UnitY();
  Eigen::Vector3d map_direction = Eigen::Vector3d::UnitZ();
  double sigma_rad = 0.02;
};
using Matrix26 = Eigen::Matrix<double, 2, 6>;
/// The two components of the axis perpendicular to the direction, divided by the standard deviation. They are
/// the sines of the angles.
[[nodiscard]] Eigen::Vector2d direction_residual(const DirectionFactor& factor, const SE3& map_T_body,
                                                 const SE3& body_T_tag, Matrix26* J_r_body = nullptr,
                                                 Matrix26* J_r_tag = nullptr);

}  // namespace waymark

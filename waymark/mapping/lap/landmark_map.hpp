#pragma once

#include <map>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/factors/odometry_factor.hpp"
#include "waymark/factors/planar_factors.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A tag or landmark as a point in the plane, for logs without corners. Its position was measured by the
/// robot's software or by a laser scanner.
struct SeenPoint {
  TagId tag{};
  /// [m], computed with the assumed mounting of the sensor.
  Eigen::Vector2d base_p = Eigen::Vector2d::Zero();
};
struct PointFrame {
  SensorTime stamp{};
  std::vector<SeenPoint> points{};
};

struct LandmarkMapOptions {
  double sight_sigma_m = 0.01;
  double sight_sigma_per_m = 0.02;
  double way_sigma_m_per_sqrt_m = 0.02;
  double turn_sigma_rad_per_sqrt_rad = 0.03;
  double distance_scale_sigma = 0.03;
  double yaw_scale_sigma = 0.2;
  double mounting_sigma_m = 0.05;
  double mounting_sigma_rad = 0.05;
  double key_m = 0.02;
  double key_rad = 0.03;
  int least_observations = 4;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.sight_sigma_m,
          Field{"sight_sigma_m", "Standard deviation of an observed point, at any distance.", 1e-6, 10});
    visit(self.sight_sigma_per_m,
          Field{"sight_sigma_per_m",
                "Standard deviation of an observed point that each metre of distance adds.", 0, 10});
    visit(self.way_sigma_m_per_sqrt_m,
          Field{"way_sigma_m_per_sqrt_m",
                "Standard deviation of the driven distance, m per square root of a metre.", 1e-6, 10});
    visit(self.turn_sigma_rad_per_sqrt_rad,
          Field{"turn_sigma_rad_per_sqrt_rad",
                "Standard deviation of a rotation, rad per square root of a radian.", 1e-6, 10});
    visit(self.distance_scale_sigma,
          Field{"distance_scale_sigma", "Standard deviation of the odometry scale.", 1e-9, 10});
    visit(self.yaw_scale_sigma, Field{"yaw_scale_sigma", "Standard deviation of the yaw scale.", 1e-9, 10});
    visit(self.mounting_sigma_m,
          Field{"mounting_sigma_m", "Standard deviation of the position of the sensor on the robot.", 1e-9,
                10});
    visit(self.mounting_sigma_rad,
          Field{"mounting_sigma_rad", "Standard deviation of the orientation of the sensor on the robot.",
                1e-9, 3});
    visit(self.key_m, Field{"key_m", "Driven distance after which a new key frame is taken.", 1e-4, 10});
    visit(self.key_rad, Field{"key_rad", "Rotation after which a new key frame is taken.", 1e-4, 3});
    visit(self.least_observations,
          Field{"least_observations", "Minimum number of observations of a landmark.", 1, 10000});
  }
};

struct MappedPoint {
  Eigen::Vector2d map_p = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  int observations = 0;  ///< number of observations in use, in key frames
  int rejected = 0;      ///< number of observations that are inconsistent with the others
};

/// Positions of the points in the base frame at the first key frame.
struct LandmarkMap {
  std::map<TagId, MappedPoint> points{};
  std::vector<std::size_t> frames{};               ///< the key frames as indices into the input
  std::vector<SE2> map_X_base{};                   ///< for each key frame
  std::vector<Eigen::Matrix3d> base_covariance{};  ///< as a left tangent in map
  OdometryScales scales{};
  OdometryScales scales_sigma{0, 0};
  SE2 base_X_assumed{};  ///< offset of the sensor from its assumed mounting
  /// Standard deviations of its x, y [m] and yaw [rad].
  Eigen::Vector3d mounting_sigma = Eigen::Vector3d::Zero();
  std::vector<TagId> rarely_observed{};
  int iterations = 0;
  bool converged = false;
  double rms_m = 0;  ///< RMS residual of the observations in use
};

/// Estimates the points, trajectory, odometry scales and sensor mounting that best explain all observations
/// and odometry. The estimate is the maximum-likelihood solution in the plane. The search first uses a Cauchy
/// loss on observations, then least squares without the outliers. It starts from odometry, so odometry alone
/// must give the approximate shape of the drive. Fails without odometry, or if no point is observed often
/// enough.
[[nodiscard]] Result<LandmarkMap> map_landmarks(const std::vector<PointFrame>& frames,
                                                const std::vector<Odometry>& odometry,
                                                const LandmarkMapOptions& options = {});

}  // namespace waymark

/// The least-squares problem of map_landmarks(): planar poses, points, odometry scales and mounting.
namespace waymark::internal {

class BlockSystem;

struct PointObservation {
  std::size_t frame = 0, point = 0;
  PlanarPointFactor factor{};
  bool used = true;
};

struct PlaneMotion {
  std::size_t to = 0;  ///< the motion is from the previous frame to this one
  PlanarMotionFactor factor{};
};

/// Frame 0 is fixed. The unknowns, in the order of the system, are frames from 1 on (x, y, yaw), points (x,
/// y), scales (distance, yaw) and mounting (x, y, yaw). Steps are added to them.
struct LandmarkProblem {
  std::vector<Eigen::Vector3d> frames{};
  std::vector<Eigen::Vector2d> points{};
  Eigen::Vector2d scales = Eigen::Vector2d::Ones();
  Eigen::Vector3d mounting = Eigen::Vector3d::Zero();
  std::vector<PointObservation> observations{};
  std::vector<PlaneMotion> motions{};
  Eigen::Vector2d scales_sigma = Eigen::Vector2d::Ones();
  Eigen::Vector3d mounting_sigma = Eigen::Vector3d::Ones();

  [[nodiscard]] int of_frame(std::size_t i) const { return static_cast<int>(i) - 1; }
  [[nodiscard]] int of_point(std::size_t i) const { return static_cast<int>(frames.size() - 1 + i); }
  [[nodiscard]] int of_scales() const { return static_cast<int>(frames.size() - 1 + points.size()); }
  [[nodiscard]] int of_mounting() const { return of_scales() + 1; }
};

[[nodiscard]] BlockSystem system_of(const LandmarkProblem& problem);
/// Whitened residual of an observation.
[[nodiscard]] Eigen::Vector2d observation_residual(const LandmarkProblem& problem,
                                                   const PointObservation& seen);
/// Adds all terms to the system and returns the cost; computes only the cost if `system` is nullptr.
/// Observations have a Cauchy loss with scale robust_chi2, unless this is 0.
double accumulate(const LandmarkProblem& problem, double robust_chi2, BlockSystem* system);
/// Minimises the cost by Levenberg-Marquardt. Returns the number of steps and whether it converged.
std::pair<int, bool> solve(LandmarkProblem& problem, double robust_chi2, int max_iterations);

}  // namespace waymark::internal

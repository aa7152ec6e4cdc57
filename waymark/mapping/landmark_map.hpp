#pragma once

#include <map>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/factors/odometry_factor.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Tags or landmarks as points in the plane, where a log has no corners: the robot's own software placed
/// them, or a laser did.
struct SeenPoint {
  TagId tag{};
  Eigen::Vector2d base_p = Eigen::Vector2d::Zero();  ///< [m], with the sensor where it is believed to sit
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
  int least_sightings = 4;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.sight_sigma_m, Field{"sight_sigma_m", "Error of a seen point, however near.", 1e-6, 10});
    visit(self.sight_sigma_per_m, Field{"sight_sigma_per_m", "What each metre of distance adds.", 0, 10});
    visit(self.way_sigma_m_per_sqrt_m,
          Field{"way_sigma_m_per_sqrt_m", "What each metre adds to the error of a way.", 1e-6, 10});
    visit(self.turn_sigma_rad_per_sqrt_rad,
          Field{"turn_sigma_rad_per_sqrt_rad", "What each radian adds to the error of a turn.", 1e-6, 10});
    visit(self.distance_scale_sigma,
          Field{"distance_scale_sigma", "How wrong the wheels' distances may be, as a share.", 1e-9, 10});
    visit(self.yaw_scale_sigma,
          Field{"yaw_scale_sigma", "How wrong the turns may be, as a share.", 1e-9, 10});
    visit(self.mounting_sigma_m,
          Field{"mounting_sigma_m", "How far the sensor may be from where it is believed.", 1e-9, 10});
    visit(self.mounting_sigma_rad, Field{"mounting_sigma_rad", "How much it may be turned.", 1e-9, 3});
    visit(self.key_m,
          Field{"key_m", "A frame counts once the robot has gone so far since the last.", 1e-4, 10});
    visit(self.key_rad, Field{"key_rad", "… or has turned so much.", 1e-4, 3});
    visit(self.least_sightings, Field{"least_sightings", "What is seen less often is left out.", 1, 10000});
  }
};

struct MappedPoint {
  Eigen::Vector2d map_p = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  int sightings = 0;  ///< in frames that count, in use
  int rejected = 0;   ///< that contradict the others
};

/// Where the points are, in the frame of the base at the first frame that counts.
struct LandmarkMap {
  std::map<TagId, MappedPoint> points{};
  std::vector<std::size_t> frames{};               ///< those that count, as indices of what was given
  std::vector<SE2> map_X_base{};                   ///< of each of them
  std::vector<Eigen::Matrix3d> base_covariance{};  ///< left tangent in map
  OdometryScales scales{};
  OdometryScales scales_sigma{0, 0};
  SE2 base_X_believed{};  ///< how far the sensor is from where it is believed to sit
  Eigen::Vector3d mounting_sigma = Eigen::Vector3d::Zero();  ///< of its x, y [m], yaw [rad]
  std::vector<TagId> hardly_seen{};
  int iterations = 0;
  bool converged = false;
  double rms_m = 0;  ///< of the sightings in use
};

/// Points, way, scales of the wheels and the mounting of the sensor that explain everything seen and driven
/// best (maximum likelihood in the plane, Cauchy's loss on sightings; then without it and without what
/// contradicts the rest). Starts from odometry, so it suits drives that odometry alone roughly knows the
/// shape of. Fails without odometry and when nothing is seen often enough.
[[nodiscard]] Result<LandmarkMap> map_landmarks(const std::vector<PointFrame>& frames,
                                                const std::vector<Odometry>& odometry,
                                                const LandmarkMapOptions& options = {});

}  // namespace waymark

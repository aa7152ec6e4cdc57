// Where the robot may be, by what it sees now and nothing else.
#include <cmath>

#include <Eigen/LU>

#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/localization/observation.hpp"
#include "waymark/pose/floor_fit.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

/// What the corners do not know: the map, the mounting.
Eigen::Matrix3d floor_of(const Landmark& landmark, double distance_m, const RiekfOptions& options) {
  const auto sq = [](double x) { return x * x; };
  const double rad2 = sq(options.tag_sigma_rad) + sq(options.mounting_sigma_rad) + landmark.covariance(5, 5);
  const double m2 = sq(options.tag_sigma_m) + sq(options.mounting_sigma_m) +
                    landmark.covariance.diagonal().head<2>().maxCoeff() + sq(distance_m) * rad2;
  return Eigen::Vector3d(m2, m2, rad2).asDiagonal();
}

/// Where base is by one pose of one tag, (17): the tag's place in the plane, its shape, and the floor.
Guess on_floor(const Landmark& landmark, const SE3& cam_T_tag, const PoseCovariance& covariance,
               const SE3& base_T_cam, double* chi2) {
  const SE2 map_X_tag(landmark.map_T_tag.translation().x(), landmark.map_T_tag.translation().y(), 0);
  const SE3 shape = lift(map_X_tag).inverse() * landmark.map_T_tag;
  const Covariance<SE3> Ad = base_T_cam.adjoint();
  const FloorFit fit = fit_to_floor({base_T_cam * cam_T_tag, Ad * covariance * Ad.transpose()}, shape,
                                    {.tilt_sigma_rad = 0.01, .height_sigma_m = 0.02});
  *chi2 += fit.chi2;
  const Uncertain<SE2> base = compose(Uncertain<SE2>{map_X_tag}, inverse(fit.a_X_b));
  return {base.mean, base.covariance};
}

Guesses guesses_of_corners(const Observation& observation, const Landmark& landmark,
                           const MountedSensor& sensor, const RiekfOptions& options) {
  Guesses guesses;
  TagDetection detection{.tag = landmark.tag, .corners_px = observation.corners.corners_px};
  const CornerCovariance L = observation.corners.whitening.inverse();
  detection.corner_covariance_px2 = L * L.transpose();
  const CameraView seen_by = sensor.view(observation.camera);
  const Result<TagPose> pose = estimate_tag_pose(detection, landmark.size_m, seen_by.camera);
  if (!pose) return guesses;
  constexpr double kImpossible = 40;  // 2 of the corners and 3 of the floor
  const auto add = [&](const TagPoseSolution& solution) {
    double chi2 = solution.chi2;
    Guess guess = on_floor(landmark, solution.cam_T_tag, solution.covariance, seen_by.base_T_cam, &chi2);
    if (chi2 > kImpossible || !guess.map_T_base.matrix().allFinite()) return;
    const Eigen::Matrix3d here = internal::coordinate_jacobian(guess.map_T_base, -1);
    guess.covariance += here * floor_of(landmark, observation.distance_m, options) * here.transpose();
    guesses.all[static_cast<std::size_t>(guesses.count++)] = guess;
  };
  add(pose->best);
  if (pose->other) add(*pose->other);
  return guesses;
}

}  // namespace

std::optional<Eigen::Vector2d> base_p_landmark(const Observation& observation, const Landmarks& landmarks,
                                               const MountedSensor& sensor) {
  if (observation.kind == ObservationKind::RangeBearing) {
    const double r = observation.planar.x();
    const double b = observation.planar.y();
    return project_to_plane(sensor.base_T_sensor) * Eigen::Vector2d(r * std::cos(b), r * std::sin(b));
  }
  if (observation.kind != ObservationKind::Corners) return observation.planar.head<2>();
  const Landmark& landmark = landmarks[observation.landmark];
  const TagDetection detection{.tag = landmark.tag, .corners_px = observation.corners.corners_px};
  const CameraView seen_by = sensor.view(observation.camera);
  const Result<TagPose> pose = estimate_tag_pose(detection, landmark.size_m, seen_by.camera);
  if (!pose) return std::nullopt;
  return (seen_by.base_T_cam * pose->best.cam_T_tag).translation().head<2>();
}

Guesses guesses_of(const Observation& observation, const Landmarks& landmarks, const MountedSensor& sensor,
                   const RiekfOptions& options) {
  const Landmark& landmark = landmarks[observation.landmark];
  if (observation.kind == ObservationKind::Corners)
    return guesses_of_corners(observation, landmark, sensor, options);
  Guesses guesses;
  if (observation.kind != ObservationKind::PlanarPose) return guesses;
  const Eigen::Vector3d map_z = landmark.map_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  const SE2 map_T_tag(landmark.map_T_tag.translation().x(), landmark.map_T_tag.translation().y(),
                      std::atan2(map_z.y(), map_z.x()));
  const SE2 base_T_tag(observation.planar.x(), observation.planar.y(), observation.planar.z());
  const Eigen::Matrix3d W = observation.whitening.inverse();
  const Uncertain<SE2> seen = from_coordinate_covariance(base_T_tag, Eigen::Matrix3d(W * W.transpose()));
  const Uncertain<SE2> base = compose(Uncertain<SE2>{map_T_tag}, inverse(seen));
  guesses.all[0] = {base.mean, base.covariance};
  guesses.count = 1;
  return guesses;
}

std::optional<Guess> guess_of_pair(const Observation& a, const Observation& b, const Landmarks& landmarks,
                                   const MountedSensor& sensor, const RiekfOptions& options) {
  const auto base_a = base_p_landmark(a, landmarks, sensor);
  const auto base_b = base_p_landmark(b, landmarks, sensor);
  if (a.landmark == b.landmark || !base_a || !base_b) return std::nullopt;
  const Eigen::Vector2d map_a = landmarks[a.landmark].map_T_tag.translation().head<2>();
  const Eigen::Vector2d map_b = landmarks[b.landmark].map_T_tag.translation().head<2>();
  const Eigen::Vector2d seen = *base_b - *base_a;
  const Eigen::Vector2d known = map_b - map_a;
  const double noise = a.kind == ObservationKind::RangeBearing
                           ? std::hypot(options.range_sigma_m,
                                        options.bearing_sigma_rad * std::max(a.distance_m, b.distance_m))
                           : std::hypot(options.point_sigma_m,
                                        options.point_sigma_share * std::max(a.distance_m, b.distance_m));
  const double sigma = std::hypot(noise, options.tag_sigma_m);
  if (std::abs(seen.norm() - known.norm()) > 3 * std::sqrt(2.0) * sigma || seen.norm() < 4 * sigma)
    return std::nullopt;
  const double yaw = std::atan2(known.y(), known.x()) - std::atan2(seen.y(), seen.x());
  const SO2 map_R_base(yaw);
  const Eigen::Vector2d centre = (map_a + map_b) / 2 - map_R_base * Eigen::Vector2d((*base_a + *base_b) / 2);
  const double sigma_yaw = std::sqrt(2.0) * sigma / known.norm();
  const double lever = ((*base_a + *base_b) / 2).norm();
  const double sigma_m = std::hypot(sigma, lever * sigma_yaw);
  const Guess guess{SE2(map_R_base, centre), {}};
  const Eigen::Matrix3d P =
      Eigen::Vector3d(sigma_m * sigma_m, sigma_m * sigma_m, sigma_yaw * sigma_yaw).asDiagonal();
  return Guess{guess.map_T_base, from_coordinate_covariance(guess.map_T_base, P).covariance};
}

}  // namespace waymark

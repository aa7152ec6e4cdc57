#include "waymark/localization/observation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "waymark/factors/pose_factors.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/pose/floor_fit.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

using Matrix23d = Eigen::Matrix<double, 2, 3>;

/// Heading of a landmark in the plane: its z axis (into the wall) projected onto the floor.
std::optional<double> heading_of(const SE3& a_T_tag) {
  const Eigen::Vector3d z = a_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  constexpr double kUpright = 0.5;  // a tag lying flat has no heading
  if (z.head<2>().norm() < kUpright) return std::nullopt;
  return std::atan2(z.y(), z.x());
}

double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

bool too_far(double distance_m, const RiekfOptions& options) {
  return !std::isfinite(distance_m) || (options.farthest_m > 0 && distance_m > options.farthest_m);
}

/// d(a_p)/d(left tangent) in the plane: [I, J p].
Matrix23d carried(const Eigen::Vector2d& p) { return (Matrix23d() << 1, 0, -p.y(), 0, 1, p.x()).finished(); }

SE2 sensor_on_floor(const SE3& base_T_sensor) { return project_to_plane(base_T_sensor); }

/// Predicted landmark in the plane for a filter at map_T_base: (x, y, heading) in base, with derivatives.
struct Expected {
  Eigen::Vector2d base_p;
  Matrix23d J_p_pose;
  Eigen::Matrix2d base_R_map;
};

Expected expect(const Landmark& landmark, const SE2& map_T_base) {
  const Eigen::Vector2d map_p = landmark.map_T_tag.translation().head<2>();
  const Eigen::Matrix2d base_R_map = map_T_base.rotation().matrix().transpose();
  return {map_T_base.inverse() * map_p, -base_R_map * carried(map_p), base_R_map};
}

void linearise_planar(const Observation& observation, const Landmark& landmark, const MountedSensor& sensor,
                      const SE2& map_T_base, Linearised& z) {
  const Expected e = expect(landmark, map_T_base);
  Eigen::Vector3d r = Eigen::Vector3d::Zero();
  r.head<2>() = e.base_p - observation.planar.head<2>();
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 6> H_mount = Eigen::Matrix<double, 3, 6>::Zero();
  Eigen::Matrix<double, 3, 6> H_tag = Eigen::Matrix<double, 3, 6>::Zero();
  H.topRows<2>() = e.J_p_pose;
  const Matrix23d mount = -carried(observation.planar.head<2>());
  H_mount.topLeftCorner<2, 2>() = mount.leftCols<2>();
  H_mount.topRightCorner<2, 1>() = mount.col(2);
  H_tag.topLeftCorner<2, 2>() = e.base_R_map;
  if (observation.kind == ObservationKind::PlanarPose) {
    const double map_heading = heading_of(landmark.map_T_tag).value_or(0);
    r.z() = wrapped(map_heading - map_T_base.yaw() - observation.planar.z());
    H(2, 2) = -1;
    H_mount(2, 5) = -1;
    H_tag(2, 5) = 1;
  }
  z.residual.head<3>() = observation.whitening * r;
  const Eigen::Vector2d from_eye = e.base_p - sensor.base_T(observation.camera).translation().head<2>();
  z.H_scale.head<2>() = -observation.whitening.topLeftCorner<2, 2>() * from_eye;
  z.H_pose.topRows<3>() = observation.whitening * H;
  z.H_mount.topRows<3>() = observation.whitening * H_mount;
  z.H_tag.topRows<3>() = observation.whitening * H_tag;
}

bool linearise_range_bearing(const Observation& observation, const Landmark& landmark,
                             const MountedSensor& sensor, const SE2& map_T_base, Linearised& z) {
  const Expected e = expect(landmark, map_T_base);
  const SE2 base_T_sensor = sensor_on_floor(sensor.base_T_sensor);
  const Eigen::Matrix2d eye_R_base = base_T_sensor.rotation().matrix().transpose();
  const Eigen::Vector2d p = base_T_sensor.inverse() * e.base_p;
  const double range = p.norm();
  if (range < 1e-6) return false;
  const Eigen::Matrix2d J =
      (Eigen::Matrix2d() << p.x() / range, p.y() / range, -p.y() / (range * range), p.x() / (range * range))
          .finished() *
      eye_R_base;
  const Eigen::Matrix2d W = observation.whitening.topLeftCorner<2, 2>();
  const Eigen::Vector2d r(range - observation.planar.x(),
                          wrapped(std::atan2(p.y(), p.x()) - observation.planar.y()));
  z.residual.head<2>() = W * r;
  z.H_scale[0] =
      -W(0, 0) *
      range;  // the predicted range, because the noise of the measured one would correlate with the residual
  z.H_pose.topRows<2>() = W * J * e.J_p_pose;
  const Matrix23d mount = -W * J * carried(e.base_p);
  z.H_mount.topLeftCorner<2, 2>() = mount.leftCols<2>();
  z.H_mount.topRightCorner<8, 1>().head<2>() = mount.col(2);
  z.H_tag.topLeftCorner<2, 2>() = W * J * e.base_R_map;
  return true;
}

/// Measured corners relative to the principal point, which scale with the focal length.
Eigen::Matrix<double, 8, 1> whitened_from_centre(const CornerFactor& factor, const CameraModel& camera) {
  const Eigen::Vector2d centre =
      std::visit([](const auto& p) { return Eigen::Vector2d(p.cx, p.cy); }, camera.projection());
  Eigen::Matrix<double, 8, 1> stretched;
  for (Eigen::Index i = 0; i < 4; ++i)
    stretched.segment<2>(2 * i) = factor.corners_px[static_cast<std::size_t>(i)] - centre;
  return factor.whitening.lazyProduct(stretched);
}

bool linearise_corners(const Observation& observation, const Landmark& landmark, const MountedSensor& sensor,
                       const SE2& map_T_base, Linearised& z) {
  CornerJacobians J;
  const CameraView seen_by = sensor.view(observation.camera);
  const auto r = corner_residual(
      observation.corners, seen_by.camera,
      {.map_T_rig = lift(map_T_base), .rig_T_cam = seen_by.base_T_cam, .body_T_tag = landmark.map_T_tag}, &J);
  if (!r || !r->allFinite()) return false;
  z.residual = *r;
  z.H_scale = *r + whitened_from_centre(observation.corners, seen_by.camera);
  z.H_pose.leftCols<2>() = J.rig.leftCols<2>();
  z.H_pose.col(2) = J.rig.col(5);
  z.H_mount = J.cam;
  z.H_tag.leftCols<3>() = J.body.leftCols<3>();
  z.H_tag.rightCols<3>() =
      J.body.rightCols<3>() + J.body.leftCols<3>() * SO3::hat(landmark.map_T_tag.translation());
  return true;
}

Eigen::Matrix3d whitening_of_planar(double sigma_m, double sigma_rad) {
  return Eigen::Vector3d(1 / sigma_m, 1 / sigma_m, 1 / sigma_rad).asDiagonal();
}

}  // namespace

int MountedSensor::camera_named(std::string_view name) const {
  const auto found = std::ranges::find(more_cameras, name, &MountedCamera::name);
  return found == more_cameras.end() ? kFirst : static_cast<int>(found - more_cameras.begin());
}

CameraView MountedSensor::view(int index) const {
  if (index == kFirst) return {*camera, base_T_sensor};
  const MountedCamera& other = more_cameras[static_cast<std::size_t>(index)];
  return {other.camera, other.base_T_cam};
}

const SE3& MountedSensor::base_T(int index) const {
  return index == kFirst ? base_T_sensor : more_cameras[static_cast<std::size_t>(index)].base_T_cam;
}

int Observation::rows() const {
  switch (kind) {
    case ObservationKind::Corners:
      return 8;
    case ObservationKind::PlanarPose:
      return 3;
    default:
      return 2;
  }
}

std::optional<Observation> observation_of(const TagDetection& detection, const Landmarks& landmarks,
                                          const MountedSensor& sensor, const RiekfOptions& options,
                                          int camera) {
  const int index = landmarks.find(detection.tag);
  if (index < 0 || (camera == MountedSensor::kFirst && !sensor.camera) || !landmarks[index].oriented)
    return std::nullopt;
  const Landmark& landmark = landmarks[index];
  Result<CornerFactor> factor = corner_factor(detection, landmark.size_m, options.corner_sigma_px);
  if (!factor) return std::nullopt;
  factor->whitening /= options.corner_noise_ratio;
  Observation observation{
      .kind = ObservationKind::Corners, .landmark = index, .camera = camera, .corners = *factor};
  observation.measured_px = factor->corners_px;
  const CameraModel& lens = sensor.view(camera).camera;
  // Estimates the distance from the diagonals, without a pose, which is sufficient for selection and limits.
  const auto& c = detection.corners_px;
  const double diagonal_px = std::max((c[2] - c[0]).norm(), (c[3] - c[1]).norm());
  const auto left = lens.unproject(c[0]);
  const auto right = lens.unproject(c[2]);
  if (!left || !right || diagonal_px < 1) return std::nullopt;
  const auto other_left = lens.unproject(c[1]);
  const auto other_right = lens.unproject(c[3]);
  if (!other_left || !other_right) return std::nullopt;
  const double angle = std::max((*left - *right).norm(), (*other_left - *other_right).norm());
  observation.distance_m = std::numbers::sqrt2 * landmark.size_m / std::max(angle, 1e-9);
  if (too_far(observation.distance_m, options)) return std::nullopt;
  return observation;
}

void bring_to_middle(Observation& observation, const Landmarks& landmarks, const MountedSensor& sensor,
                     const SE2& map_T_base, const Eigen::Vector3d& velocity, double readout_s) {
  if (observation.kind != ObservationKind::Corners) return;
  const Landmark& landmark = landmarks[observation.landmark];
  const CameraView seen_by = sensor.view(observation.camera);
  const SE3 cam_T_base = seen_by.base_T_cam.inverse();
  MovingTag tag{.cam_T_tag = cam_T_base * lift(map_T_base).inverse() * landmark.map_T_tag,
                .size_m = landmark.size_m};
  Vector6 of_base;
  of_base << velocity.x(), velocity.y(), 0, 0, 0, velocity.z();
  tag.twist = -(cam_T_base.adjoint() * of_base);
  const auto shift = rolling_shift(tag, observation.measured_px, seen_by.camera, readout_s);
  if (!shift || !shift->allFinite()) return;
  for (std::size_t i = 0; i < 4; ++i)
    observation.corners.corners_px[i] =
        observation.measured_px[i] - shift->segment<2>(static_cast<Eigen::Index>(2 * i));
}

std::optional<Observation> observation_of(const SeenTagPose& seen, const Landmarks& landmarks,
                                          const MountedSensor& sensor, const RiekfOptions& options,
                                          int camera) {
  const int index = landmarks.find(seen.tag);
  if (index < 0 || !seen.cam_T_tag.matrix().allFinite()) return std::nullopt;
  const SE3 cam_T_tag(seen.cam_T_tag.rotation(), options.sight_scale * seen.cam_T_tag.translation());
  const SE3 base_T_tag = sensor.base_T(camera) * cam_T_tag;
  Observation observation{.kind = ObservationKind::PlanarPoint, .landmark = index, .camera = camera};
  observation.distance_m = cam_T_tag.translation().norm();
  if (too_far(observation.distance_m, options)) return std::nullopt;
  observation.planar.head<2>() = base_T_tag.translation().head<2>();
  const double sigma_m =
      std::hypot(options.point_sigma_m, options.point_sigma_share * observation.distance_m);
  constexpr double kHeadingSigma = 0.1;  // for a single square; six degrees or more
  observation.whitening = whitening_of_planar(sigma_m, kHeadingSigma);
  const auto heading = heading_of(base_T_tag);
  if (landmarks[index].oriented && heading && heading_of(landmarks[index].map_T_tag)) {
    observation.kind = ObservationKind::PlanarPose;
    observation.planar.z() = *heading;
  }
  return observation;
}

std::optional<Observation> observation_of(const RangeBearing& seen, const Landmarks& landmarks,
                                          const MountedSensor& sensor, const RiekfOptions& options) {
  static_cast<void>(sensor);
  const int index = landmarks.find(seen.landmark);
  const bool sound = std::isfinite(seen.range_m) && std::isfinite(seen.bearing_rad) && seen.range_m > 0;
  if (index < 0 || !sound || too_far(seen.range_m, options)) return std::nullopt;
  Observation observation{
      .kind = ObservationKind::RangeBearing, .landmark = index, .distance_m = seen.range_m};
  observation.planar = {seen.range_m, seen.bearing_rad, 0};
  observation.whitening.diagonal() << 1 / options.range_sigma_m, 1 / options.bearing_sigma_rad, 1;
  return observation;
}

std::optional<Linearised> linearise(const Observation& observation, const Landmarks& landmarks,
                                    const MountedSensor& sensor, const SE2& map_T_base) {
  const Landmark& landmark = landmarks[observation.landmark];
  Linearised z{.landmark = observation.landmark, .rows = observation.rows()};
  switch (observation.kind) {
    case ObservationKind::Corners:
      if (!linearise_corners(observation, landmark, sensor, map_T_base, z)) return std::nullopt;
      break;
    case ObservationKind::RangeBearing:
      if (!linearise_range_bearing(observation, landmark, sensor, map_T_base, z)) return std::nullopt;
      break;
    default:
      linearise_planar(observation, landmark, sensor, map_T_base, z);
  }
  return z;
}

// Guesses of the pose from only the current observations.
namespace {

/// Covariance of the map and the mounting, which the fit to the corners does not include.
Eigen::Matrix3d floor_of(const Landmark& landmark, double distance_m, const RiekfOptions& options) {
  const auto sq = [](double x) { return x * x; };
  const double rad2 = sq(options.tag_sigma_rad) + sq(options.mounting_sigma_rad) + landmark.covariance(5, 5);
  const double m2 = sq(options.tag_sigma_m) + sq(options.mounting_sigma_m) +
                    landmark.covariance.diagonal().head<2>().maxCoeff() + sq(distance_m) * rad2;
  return Eigen::Vector3d(m2, m2, rad2).asDiagonal();
}

/// Pose of the base from one pose of one tag, (17): from the tag's position in the plane, its shape, and the
/// floor.
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
  constexpr double kImpossible = 40;  // chi-square for 2 (corners) + 3 (floor) degrees of freedom
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

#include "waymark/mapping/lap/lap_bundle.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/lap/motion_tracks.hpp"

namespace waymark {
namespace {

using MaybePoses = std::vector<std::optional<SE3>>;
using MaybeMotions = std::vector<std::optional<SE2>>;
using MaybeRates = std::vector<std::optional<SE2::Tangent>>;

MaybePoses chain_poses(const LapInput& lap, const Trajectory& trajectory) {
  MaybePoses poses(lap.frames.size());
  std::size_t at = 0;
  for (std::size_t i = 0; i < lap.frames.size(); ++i) {
    while (at < trajectory.size() && trajectory[at].stamp < lap.frames[i].stamp) ++at;
    if (at < trajectory.size() && trajectory[at].stamp == lap.frames[i].stamp)
      poses[i] = trajectory[at].map_T_base;
  }
  return poses;
}

/// Odometry at the times of the frames.
struct Wheels {
  MaybeMotions odom_T_base{};
  MaybeRates rates{};
};

Wheels wheels_of(const LapInput& lap) {
  const OdometryTrack track(lap.odometry);
  Wheels wheels;
  for (const TagFrame& frame : lap.frames) {
    wheels.odom_T_base.push_back(track.at(frame.stamp));
    wheels.rates.push_back(track.rate_at(frame.stamp));
  }
  return wheels;
}

/// Fills in frames between placed ones using odometry, first forwards, then backwards.
void fill_by_odometry(const MaybeMotions& odom_T_base, MaybePoses& poses) {
  const auto carry = [&](std::size_t from, std::size_t to) {
    if (poses[to] || !poses[from] || !odom_T_base[from] || !odom_T_base[to]) return;
    poses[to] = *poses[from] * lift(odom_T_base[from]->inverse() * *odom_T_base[to]);
  };
  for (std::size_t i = 1; i < poses.size(); ++i) carry(i - 1, i);
  for (std::size_t i = poses.size(); i-- > 1;) carry(i, i - 1);
}

/// The factor from the previous frame to frame i; both must have odometry.
OdometryFactor odometry_factor(const LapInput& lap, const Wheels& wheels, std::size_t i,
                               const LapModelOptions& o) {
  const SE2 motion = wheels.odom_T_base[i - 1]->inverse() * *wheels.odom_T_base[i];
  const double metres = motion.translation().norm();
  const double radians = std::abs(motion.yaw());
  const auto square = [](double x) { return x * x; };
  const double var_m = square(o.odometry_sigma_m) + square(o.odometry_sigma_m_per_sqrt_m) * metres;
  const double var_rad = square(o.odometry_sigma_rad) + square(o.odometry_sigma_rad_per_sqrt_m) * metres +
                         square(o.odometry_sigma_rad_per_sqrt_rad) * radians;
  const Eigen::Vector3d sigma(std::sqrt(var_m), std::sqrt(var_m), std::sqrt(var_rad));
  OdometryFactor factor{motion, sigma.cwiseInverse().asDiagonal()};
  factor.duration_s = to_seconds(lap.frames[i].stamp - lap.frames[i - 1].stamp);
  if (wheels.rates[i - 1] && wheels.rates[i]) factor.rate_change = *wheels.rates[i] - *wheels.rates[i - 1];
  return factor;
}

/// Whether the source of the turns changes between two times.
bool other_turns_between(const LapInput& lap, SensorTime from, SensorTime to) {
  const auto span = std::ranges::upper_bound(lap.other_turns, from, {}, &TimeSpan::to);
  return span != lap.other_turns.end() && span->from < to;
}

constexpr double kFixedSigma = 1e-6;  // for values that are fixed by definition; avoids rounding problems
constexpr double kFreeTilt_rad = 0.5;

/// The anchor defines the position and the heading of the map, but not its tilt.
PosePriorFactor anchor_prior(const SE3& map_T_anchor) {
  Vector6 variance;
  variance << kFixedSigma, kFixedSigma, kFixedSigma, kFreeTilt_rad, kFreeTilt_rad, kFixedSigma;
  variance = variance.cwiseAbs2().eval();
  const Matrix6 P = variance.asDiagonal();
  return {map_T_anchor, whitening_of(from_coordinate_covariance(map_T_anchor, P).covariance)};
}

/// Whether the map will be level with its floor.
bool is_level(const LapInput& lap) { return !lap.prior || lap.prior->map.floor.covariance; }

void add_floor(const LapInput& lap, double z_m, LapBundle& result) {
  SE3 map_T_plane({}, {0, 0, z_m});
  if (lap.prior) map_T_plane = SE3(map_T_floor(lap.prior->map.floor).rotation(), map_T_plane.translation());
  result.floor = result.bundle.add(map_T_plane);
  result.bundle.priors.push_back({result.floor, floor_prior(map_T_plane, is_level(lap))});
}

/// Cameras triggered together share a base pose.
bool triggered_together(const TagFrame& a, const TagFrame& b) {
  return a.stamp == b.stamp && a.camera != b.camera;
}

void add_tag_pose(const TagId& tag, const SE3& map_T_tag, bool fixed, LapBundle& result) {
  result.tags[tag] = result.bundle.add(map_T_tag, fixed);
  result.sizes[tag] = result.bundle.sizes.size();
  result.bundle.sizes.push_back({result.bundle.common_size.log_scale, result.size_sigma});
}

/// Adds a term for an observation of a placed tag in a placed frame.
void add_corners(const LapInput& lap, const LapModelOptions& options,
                 const LapBundle::Observation& observation, LapBundle& result) {
  const TagDetection& detection = lap.frames[observation.frame].detections[observation.detection];
  const auto tag = result.tags.find(detection.tag);
  if (tag == result.tags.end() || !result.bases[observation.frame]) return;
  const auto factor = corner_factor(detection, *lap.sizes.size_m(detection.tag), options.corner_sigma_px);
  if (!factor) return;
  const std::size_t camera = internal::camera_index(lap, lap.frames[observation.frame].camera);
  CornerTerm term{
      *result.bases[observation.frame], result.cam_at(camera), result.map, tag->second, camera, *factor};
  term.size = result.sizes.at(detection.tag);
  result.bundle.corners.push_back(std::move(term));
  result.observations.push_back(observation);
}

}  // namespace

PosePriorFactor floor_prior(const SE3& map_T_floor, bool lean_known) {
  const double lean = lean_known ? kFixedSigma : kFreeTilt_rad;
  Vector6 sigma;
  sigma << 1e-3, 1e-3, 10, lean, lean, 1e-3;
  return {map_T_floor, sigma.cwiseInverse().asDiagonal()};
}

std::vector<PoseIndex> LapBundle::base_poses() const {
  std::vector<PoseIndex> poses;
  for (const auto& base : bases) {
    if (base && (poses.empty() || poses.back() != *base)) poses.push_back(*base);
  }
  return poses;
}

LapBundle lap_bundle(const LapInput& lap, const ChainResult& start, const LapModelOptions& options) {
  LapBundle result;
  Bundle& bundle = result.bundle;
  bundle.cameras = {lap.camera};
  result.map = bundle.add({}, true);
  result.cam = bundle.add(lap.base_T_cam, true);
  for (const MountedCamera& other : lap.more_cameras) {
    bundle.cameras.push_back(other.camera);
    result.more_cams.push_back(bundle.add(other.base_T_cam, true));
  }
  MaybePoses poses = chain_poses(lap, start.trajectory);
  const auto first = std::ranges::find_if(poses, [](const auto& pose) { return pose.has_value(); });
  const double floor_z = first == poses.end() ? 0 : (*first)->translation().z();
  add_floor(lap, floor_z, result);
  for (const auto& [id, tag] : start.map.tags)
    add_tag_pose(id, tag.map_T_tag, id == lap.anchor && !is_level(lap), result);
  if (const auto anchor = result.tags.find(lap.anchor); anchor != result.tags.end())
    result.anchor = anchor->second;
  if (result.anchor && is_level(lap))
    bundle.priors.push_back({*result.anchor, anchor_prior(lap.map_T_anchor)});

  const Wheels wheels = wheels_of(lap);
  fill_by_odometry(wheels.odom_T_base, poses);
  bundle.odometry_scales.resize(lap.other_turns.empty() ? 1 : 2);
  result.bases.resize(lap.frames.size());
  for (std::size_t i = 0; i < lap.frames.size(); ++i) {
    if (!poses[i]) continue;
    if (i > 0 && result.bases[i - 1] && triggered_together(lap.frames[i - 1], lap.frames[i])) {
      result.bases[i] = result.bases[i - 1];
      continue;
    }
    result.bases[i] = bundle.add(*poses[i]);
    bundle.on_floor.push_back(
        {result.floor, *result.bases[i], {options.floor.height_sigma_m, options.floor.tilt_sigma_rad}});
    if (i == 0 || !result.bases[i - 1] || !wheels.odom_T_base[i - 1] || !wheels.odom_T_base[i]) continue;
    const bool otherwise = other_turns_between(lap, lap.frames[i - 1].stamp, lap.frames[i].stamp);
    bundle.odometry.push_back({*result.bases[i - 1], *result.bases[i], otherwise ? std::size_t{1} : 0,
                               odometry_factor(lap, wheels, i, options)});
  }
  for (BundleScales& scales : bundle.odometry_scales) scales.fixed = bundle.odometry.empty();
  std::size_t detections = 0;
  for (const TagFrame& frame : lap.frames) detections += frame.detections.size();
  bundle.corners.reserve(detections);
  result.observations.reserve(detections);
  for (std::size_t i = 0; i < lap.frames.size(); ++i) {
    for (std::size_t d = 0; d < lap.frames[i].detections.size(); ++d)
      add_corners(lap, options, {i, d}, result);
  }
  return result;
}

void free_sizes(double sigma, double common_sigma, LapBundle& lap) {
  lap.size_sigma = sigma;
  lap.bundle.common_size.sigma = common_sigma;
  for (BundleSize& size : lap.bundle.sizes) size.sigma = sigma;
}

void add_tag(const LapInput& lap, const TagId& tag, const SE3& map_T_tag,
             const std::vector<LapBundle::Observation>& observations, const LapModelOptions& options,
             LapBundle& result) {
  add_tag_pose(tag, map_T_tag, false, result);
  for (const LapBundle::Observation& observation : observations)
    add_corners(lap, options, observation, result);
}

}  // namespace waymark

namespace waymark::internal {

namespace {

/// One alternative for each pose of the tag. `value_of` returns the value as a function of cam_T_tag, and the
/// frame whose left tangent contains the error.
template <class Value>
Vote<SE3> vote_of(const TagDetection& detection, const CameraModel& camera, const LapInput& lap,
                  const Value& value_of) {
  Vote<SE3> vote;
  const auto pose = estimate_tag_pose(detection, lap.sizes, camera);
  if (!pose) return vote;
  const auto add = [&](const TagPoseSolution& solution) {
    const auto [value, map_T_cam] = value_of(solution.cam_T_tag);
    const SE3::Jacobian Ad = map_T_cam.adjoint();
    // The base pose is uncertain, too.
    const PoseCovariance covariance =
        Ad * solution.covariance * Ad.transpose() + 1e-4 * PoseCovariance::Identity();
    vote.push_back({value, covariance.inverse(), solution.chi2 - pose->best.chi2});
  };
  add(pose->best);
  if (pose->other) add(*pose->other);
  return vote;
}

}  // namespace

std::size_t camera_index(const LapInput& lap, const std::string& name) {
  const auto found = std::ranges::find(lap.more_cameras, name, &MountedCamera::name);
  return found == lap.more_cameras.end() ? 0 : static_cast<std::size_t>(found - lap.more_cameras.begin()) + 1;
}

Vote<SE3> vote_for_place(const TagDetection& detection, const std::string& camera, const LapInput& lap,
                         const SE3& map_T_base) {
  const CameraView seen_by = camera_of(lap, camera);
  const SE3 map_T_cam = map_T_base * seen_by.base_T_cam;
  return vote_of(detection, seen_by.camera, lap,
                 [&](const SE3& cam_T_tag) { return std::pair(map_T_cam * cam_T_tag, map_T_cam); });
}

Vote<SE3> vote_for_base(const TagDetection& detection, const std::string& camera, const LapInput& lap,
                        const SE3& map_T_tag) {
  const CameraView seen_by = camera_of(lap, camera);
  const SE3 cam_T_base = seen_by.base_T_cam.inverse();
  return vote_of(detection, seen_by.camera, lap, [&](const SE3& cam_T_tag) {
    const SE3 map_T_cam = map_T_tag * cam_T_tag.inverse();
    return std::pair(map_T_cam * cam_T_base, map_T_cam);
  });
}

}  // namespace waymark::internal

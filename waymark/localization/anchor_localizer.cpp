#include "waymark/localization/anchor_localizer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/LU>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/pose/floor_fit.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

constexpr Duration kOdometryKept = std::chrono::seconds(1);
constexpr double kGate = 22.5;  // 0.999 quantile of chi-square: 2 (corners) + 1 of 3 (floor) + 3 (plane)

/// The pose of the base from one pose of one tag: equation 3.1 in the plane.
FloorFit base_on_floor(const MappedTag& tag, const TagPoseSolution& solution, const SE3& base_T_cam,
                       const AnchorOptions& options) {
  constexpr double kAnyHeight = 10;  // because the origin of the map may be off the floor
  // The position of the tag in the plane, with the axes of the map; the rest of its pose is the shape.
  const SE2 map_X_tag(tag.map_T_tag.translation().x(), tag.map_T_tag.translation().y(), 0);
  const SE3 shape = lift(map_X_tag).inverse() * tag.map_T_tag;
  const Covariance<SE3> Ad = base_T_cam.adjoint();
  const FloorFit fit =
      fit_to_floor({base_T_cam * solution.cam_T_tag, Ad * solution.covariance * Ad.transpose()}, shape,
                   {.tilt_sigma_rad = options.tilt_sigma_rad, .height_sigma_m = kAnyHeight});
  Uncertain<SE2> tag_X_base = inverse(fit.a_X_b);
  tag_X_base.covariance.diagonal() +=
      Eigen::Vector3d(options.map_sigma_m, options.map_sigma_m, options.map_sigma_rad).cwiseAbs2();
  return {compose(Uncertain<SE2>{map_X_tag}, tag_X_base), solution.chi2 + fit.chi2};
}

/// Squared Mahalanobis distance between two independent estimates.
double apart(const Uncertain<SE2>& a, const Uncertain<SE2>& b) {
  const SE2::Tangent r = minus(a.mean, b.mean);
  return r.dot((a.covariance + b.covariance).inverse() * r);
}

double position_sigma_m(const Uncertain<SE2>& map_X_base) {
  return LocalizationEstimate{.covariance = coordinate_covariance(map_X_base)}.position_sigma_m();
}

}  // namespace

AnchorLocalizer::AnchorLocalizer(TagMap map, CameraModel camera, const SE3& base_T_cam,
                                 const AnchorOptions& options, std::vector<MountedCamera> more_cameras)
    : map_(std::move(map)),
      cameras_{std::move(camera), base_T_cam, std::move(more_cameras)},
      options_(options) {}

std::vector<AnchorLocalizer::Observation> AnchorLocalizer::observations(const TagFrame& frame) const {
  std::vector<Observation> seen;
  const CameraView seen_by = camera_of(cameras_, frame.camera);
  for (const TagDetection& detection : frame.detections) {
    const MappedTag* tag = map_.find(detection.tag);
    if (tag == nullptr) continue;
    const Result<TagPose> pose = estimate_tag_pose(detection, tag->size_m, seen_by.camera);
    if (!pose) continue;
    const double distance_m = pose->best.cam_T_tag.translation().norm();
    if (distance_m > options_.max_tag_distance_m) continue;
    Observation observation{.distance_m = distance_m, .ambiguity_ratio = pose->ambiguity_ratio()};
    observation.map_X_base.push_back(base_on_floor(*tag, pose->best, seen_by.base_T_cam, options_));
    if (pose->other)
      observation.map_X_base.push_back(base_on_floor(*tag, *pose->other, seen_by.base_T_cam, options_));
    seen.push_back(std::move(observation));
  }
  return seen;
}

std::optional<AnchorLocalizer::Fix> AnchorLocalizer::fix_from_nearest(const std::vector<Observation>& seen,
                                                                      const Uncertain<SE2>& predicted) {
  const auto nearest = std::ranges::min_element(seen, {}, &Observation::distance_m);
  if (nearest == seen.end()) return std::nullopt;
  std::optional<Fix> best;
  double least = std::numeric_limits<double>::infinity();
  for (const FloorFit& fit : nearest->map_X_base) {
    const double chi2 = fit.chi2 + apart(fit.a_X_b, predicted);
    if (chi2 >= least) continue;
    least = chi2;
    best = Fix{fit.a_X_b, nearest->distance_m};
  }
  return best;
}

std::optional<AnchorLocalizer::Fix> AnchorLocalizer::fix_from_all(const std::vector<Observation>& seen) {
  const auto agreed = internal::agree(votes_of(seen, {}), kGate);
  if (!agreed || agreed->votes < 2) return std::nullopt;
  return Fix{agreed->value, std::numeric_limits<double>::infinity()};
}

std::vector<internal::Vote<SE2>> AnchorLocalizer::votes_of(const std::vector<Observation>& seen,
                                                           const SE2& base_X_to) {
  std::vector<internal::Vote<SE2>> votes;
  for (const Observation& observation : seen) {
    internal::Vote<SE2> vote;
    for (const FloorFit& fit : observation.map_X_base)
      vote.push_back({fit.a_X_b.mean * base_X_to, fit.a_X_b.covariance.inverse(), fit.chi2});
    votes.push_back(std::move(vote));
  }
  return votes;
}

/// Initialises the pose from scratch: the tags in several frames, related by odometry, vote for it.
void AnchorLocalizer::initialise(const std::vector<Observation>& seen, const SE2& odom_T_base) {
  const bool nothing_certain =
      seen.empty() || (seen.size() == 1 && seen[0].ambiguity_ratio > options_.max_ambiguity);
  if (nothing_certain) return;
  recent_votes_.push_back(votes_of(seen, odom_T_base.inverse()));
  const auto frames = static_cast<std::size_t>(options_.frames_to_start);
  while (recent_votes_.size() > frames) recent_votes_.pop_front();
  if (recent_votes_.size() < frames) return;
  std::vector<internal::Vote<SE2>> all;
  for (const auto& votes : recent_votes_) all.insert(all.end(), votes.begin(), votes.end());
  const auto map_X_odom = internal::agree(all, kGate);
  if (!map_X_odom || 2 * map_X_odom->votes < static_cast<int>(all.size())) return;
  // Map errors are the same in all frames, so the result is only as certain as a single frame.
  const Eigen::Matrix3d covariance = map_X_odom->value.covariance * static_cast<double>(frames);
  anchor({map_X_odom->value.mean * odom_T_base, covariance}, odom_T_base);
}

void AnchorLocalizer::anchor(const Uncertain<SE2>& map_X_base, const SE2& odom_T_base) {
  ++fixes_;
  contradictions_ = 0;
  recent_votes_.clear();
  map_T_odom_ = map_X_base.mean * odom_T_base.inverse();
  fix_covariance_ = coordinate_covariance(map_X_base);
  driven_since_fix_m_ = 0;
}

std::optional<SE2> AnchorLocalizer::odometry_at(SensorTime stamp) const {
  if (odometry_.empty()) return std::nullopt;
  if (stamp >= odometry_.back().stamp) {  // extrapolates with the latest velocity
    const Odometry& newest = odometry_.back();
    const double dt_s = to_seconds(stamp - newest.stamp);
    return newest.odom_T_base * SE2::exp({newest.speed_m_s * dt_s, 0, newest.yaw_rate_rad_s * dt_s});
  }
  for (std::size_t i = odometry_.size() - 1; i > 0; --i) {
    const Odometry& a = odometry_[i - 1];
    const Odometry& b = odometry_[i];
    if (a.stamp <= stamp) {
      const double u = to_seconds(stamp - a.stamp) / to_seconds(b.stamp - a.stamp);
      return interpolate(a.odom_T_base, b.odom_T_base, u);
    }
  }
  return std::nullopt;  // older than the stored odometry
}

bool AnchorLocalizer::accepted(const Fix& fix, const SE2& map_X_predicted) const {
  if (fix.distance_m <= options_.near_distance_m) return true;
  const SE2 predicted_X_fix = map_X_predicted.inverse() * fix.map_X_base.mean;
  return predicted_X_fix.translation().norm() <= options_.max_jump_m &&
         std::abs(predicted_X_fix.yaw()) <= options_.max_jump_rad;
}

/// Pose of the base from the last fix and the odometry since then.
Uncertain<SE2> AnchorLocalizer::predicted_pose(const SE2& odom_T_base) const {
  const double d = driven_since_fix_m_;
  const double heading = options_.drift_rad_per_m * d;
  const double position =
      std::hypot(options_.drift_share * d, heading * d / 2, std::sqrt(fix_covariance_(2, 2)) * d);
  const Eigen::Vector3d drift(position * position, position * position, heading * heading);
  return from_coordinate_covariance(*map_T_odom_ * odom_T_base,
                                    Eigen::Matrix3d(fix_covariance_ + Eigen::Matrix3d(drift.asDiagonal())));
}

void AnchorLocalizer::add(const TagFrame& frame) {
  const std::optional<SE2> odom_T_base = odometry_at(frame.stamp);
  if (!odom_T_base) return;
  if (options_.plain) return add_published(frame, *odom_T_base);
  const std::vector<Observation> seen = observations(frame);
  if (!map_T_odom_ || contradictions_ >= options_.jumps_to_restart) return initialise(seen, *odom_T_base);
  const Uncertain<SE2> predicted = predicted_pose(*odom_T_base);
  const std::optional<Fix> all = fix_from_all(seen);
  const bool unsure = position_sigma_m(predicted) > options_.unsure_sigma_m;
  const std::optional<Fix> fix = unsure && all ? all : fix_from_nearest(seen, predicted);
  if (!fix) return;
  const bool contradicted = all && !accepted(*all, predicted.mean);
  const bool jumps = !accepted(*fix, predicted.mean);
  contradictions_ = contradicted || jumps ? contradictions_ + 1 : 0;
  rejected_ += jumps ? 1 : 0;
  if (jumps || position_sigma_m(predicted) < position_sigma_m(fix->map_X_base)) return;
  const int contradictions = contradictions_;
  anchor(fix->map_X_base, *odom_T_base);
  contradictions_ = contradictions;
}

/// Implements exactly the published algorithm: sections "Choosing the Best Tag" to "Odometry Fusion and
/// Outlier Rejection".
void AnchorLocalizer::add_published(const TagFrame& frame, const SE2& odom_T_base) {
  std::optional<Fix> fix;
  const CameraView seen_by = camera_of(cameras_, frame.camera);
  for (const TagDetection& detection : frame.detections) {
    const MappedTag* tag = map_.find(detection.tag);
    if (tag == nullptr) continue;
    const Result<TagPose> pose = estimate_tag_pose(detection, tag->size_m, seen_by.camera);
    if (!pose) continue;
    const SE3& cam_T_tag = pose->best.cam_T_tag;
    const double distance_m = cam_T_tag.translation().norm();
    if (distance_m > options_.max_tag_distance_m || (fix && fix->distance_m <= distance_m)) continue;
    const SE3 map_T_base = tag->map_T_tag * cam_T_tag.inverse() * seen_by.base_T_cam.inverse();
    const Eigen::Vector3d sigma(options_.map_sigma_m, options_.map_sigma_m, options_.map_sigma_rad);
    fix = Fix{{project_to_plane(map_T_base), Eigen::Matrix3d(sigma.cwiseAbs2().asDiagonal())}, distance_m};
  }
  if (!fix) return;
  const bool jumps = map_T_odom_ && !accepted(*fix, *map_T_odom_ * odom_T_base);
  contradictions_ = jumps ? contradictions_ + 1 : 0;
  rejected_ += jumps ? 1 : 0;
  if (jumps && contradictions_ < options_.jumps_to_restart) return;
  anchor(fix->map_X_base, odom_T_base);
}

void AnchorLocalizer::add(const Odometry& odometry) {
  if (!odometry_.empty()) {
    const SE2 step = odometry_.back().odom_T_base.inverse() * odometry.odom_T_base;
    driven_since_fix_m_ += step.translation().norm();
  }
  odometry_.push_back(odometry);
  while (odometry_.front().stamp + kOdometryKept < odometry.stamp) odometry_.pop_front();
}

std::optional<LocalizationEstimate> AnchorLocalizer::estimate() const {
  if (!map_T_odom_ || odometry_.empty()) return std::nullopt;
  const Odometry& newest = odometry_.back();
  const Uncertain<SE2> map_X_base = predicted_pose(newest.odom_T_base);
  return LocalizationEstimate{newest.stamp, map_X_base.mean, coordinate_covariance(map_X_base)};
}

}  // namespace waymark

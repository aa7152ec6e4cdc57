#include "waymark/localization/anchor_localizer.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

constexpr Duration kOdometryKept = std::chrono::seconds(1);

/// Covariance of (x, y, yaw) of the base from that of the tag in the camera.
Eigen::Matrix3d planar_covariance(const SE3& base_T_cam, const SE3& map_T_tag, const SE3& cam_T_tag,
                                  const PoseCovariance& covariance) {
  const Uncertain<SE3> cam_T_tag_uncertain{cam_T_tag, covariance};
  const Uncertain<SE3> tag_T_cam = inverse(cam_T_tag_uncertain);
  const Uncertain<SE3> map_T_cam = compose(Uncertain<SE3>{map_T_tag}, tag_T_cam);
  const Uncertain<SE3> map_T_base = compose(map_T_cam, Uncertain<SE3>{base_T_cam.inverse()});
  const auto coordinates = coordinate_covariance(map_T_base);
  constexpr int kPlanar[3] = {0, 1, 5};  // x, y, rotation about z
  Eigen::Matrix3d planar;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) planar(i, j) = coordinates(kPlanar[i], kPlanar[j]);
  }
  return planar;
}

}  // namespace

AnchorLocalizer::AnchorLocalizer(TagMap map, CameraModel camera, const SE3& base_T_cam,
                                 const AnchorOptions& options)
    : map_(std::move(map)), camera_(std::move(camera)), base_T_cam_(base_T_cam), options_(options) {}

std::optional<AnchorLocalizer::Fix> AnchorLocalizer::fix_from_nearest(const TagFrame& frame) const {
  std::optional<Fix> nearest;
  for (const TagDetection& detection : frame.detections) {
    const MappedTag* tag = map_.find(detection.tag);
    if (tag == nullptr) continue;
    const Result<TagPose> pose = estimate_tag_pose(detection, tag->size_m, camera_);
    if (!pose || pose->ambiguity_ratio() > options_.max_ambiguity) continue;
    const SE3& cam_T_tag = pose->best.cam_T_tag;
    const double distance = cam_T_tag.translation().norm();
    if (distance > options_.max_tag_distance_m || (nearest && distance >= nearest->distance_m)) continue;
    const SE3 map_T_base = tag->map_T_tag * cam_T_tag.inverse() * base_T_cam_.inverse();
    nearest = Fix{project_to_plane(map_T_base),
                  planar_covariance(base_T_cam_, tag->map_T_tag, cam_T_tag, pose->best.covariance), distance};
  }
  return nearest;
}

std::optional<SE2> AnchorLocalizer::odometry_at(SensorTime stamp) const {
  if (odometry_.empty()) return std::nullopt;
  if (stamp >= odometry_.back().stamp) {  // carry on at the newest speed
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
  return std::nullopt;  // older than what is kept
}

bool AnchorLocalizer::believed(const Fix& fix, const SE2& map_T_predicted) const {
  if (fix.distance_m <= options_.near_distance_m || rejected_in_a_row_ >= options_.jumps_until_believed)
    return true;
  const SE2 predicted_T_fix = map_T_predicted.inverse() * fix.map_T_base;
  return predicted_T_fix.translation().norm() <= options_.max_jump_m &&
         std::abs(predicted_T_fix.yaw()) <= options_.max_jump_rad;
}

void AnchorLocalizer::add(const TagFrame& frame) {
  const std::optional<SE2> odom_T_base = odometry_at(frame.stamp);
  const std::optional<Fix> fix = fix_from_nearest(frame);
  if (!odom_T_base || !fix) return;
  if (map_T_odom_ && !believed(*fix, *map_T_odom_ * *odom_T_base)) {
    ++rejected_in_a_row_;
    ++rejected_;
    return;
  }
  rejected_in_a_row_ = 0;
  ++fixes_;
  map_T_odom_ = fix->map_T_base * odom_T_base->inverse();
  fix_covariance_ = fix->covariance;
  driven_since_fix_m_ = 0;
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
  LocalizationEstimate estimate{
      .stamp = newest.stamp, .map_T_base = *map_T_odom_ * newest.odom_T_base, .covariance = fix_covariance_};
  const double d = driven_since_fix_m_;
  const double heading = options_.drift_rad_per_m * d;
  const double position =
      std::hypot(options_.drift_share * d, heading * d / 2, std::sqrt(fix_covariance_(2, 2)) * d);
  estimate.covariance.diagonal() +=
      Eigen::Vector3d(position * position, position * position, heading * heading);
  return estimate;
}

}  // namespace waymark
